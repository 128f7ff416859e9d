/// How far the members of an ensemble, coupled runs or candidates are that came to an end.
#pragma once

namespace talus::ensemble {

struct Progress {
  long done = 0, asked = 0, failed = 0;  // failed: of those that are done
};

}  // namespace talus::ensemble
