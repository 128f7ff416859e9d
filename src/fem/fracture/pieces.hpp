/// Which cells of a broken structure stay together, and which of these pieces nothing holds any more.
#pragma once
#include <set>

#include "fem/members/stresses.hpp"

namespace talus::fem {

class Pieces {
 public:
  Pieces(const StructureBody& body, const Stresses& stresses) : body_(body), stresses_(stresses) {}

  long count_cuts() const;
  std::vector<std::vector<int>> loose() const;
  std::vector<int> parted_beside(const std::vector<std::vector<int>>& pieces) const;

 private:
  double face_opening(int a, int b, int face) const;
  bool parted(int cell) const;
  std::vector<int> labels() const;
  std::set<int> held(const std::vector<int>& label) const;

  const StructureBody& body_;
  const Stresses& stresses_;
};

}  // namespace talus::fem
