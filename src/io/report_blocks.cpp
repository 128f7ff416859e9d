#include "io/report_data.hpp"

#include <algorithm>
#include <cmath>

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

constexpr std::size_t pose_budget = 6'000'000;  // bytes, before base64

/// Farthest vertex of each block from its centroid [m].
std::vector<double> radii_of_blocks(const ReportData& d) {
  std::vector<double> radii(d.names.size(), 0.0);
  if (radii.empty()) return radii;
  const auto v = d.file.read<double>("/geometry/blocks/vertices");
  const auto offset = d.file.read<std::int64_t>("/geometry/blocks/vertex_offset");
  for (std::size_t b = 0; b + 1 < offset.values.size() && b < radii.size(); ++b)
    for (auto i = static_cast<std::size_t>(offset.values[b]);
         i < static_cast<std::size_t>(offset.values[b + 1]) && i < v.rows(); ++i)
      radii[b] = std::max(radii[b], std::hypot(v.values[3 * i], v.values[3 * i + 1], v.values[3 * i + 2]));
  return radii;
}

void extend(Box3& box, const Vec3& centre, double radius) {
  box.extend(Vec3(centre - Vec3::Constant(radius)));
  box.extend(Vec3(centre + Vec3::Constant(radius)));
}

}  // namespace

void add_poses(ReportData& d) {
  const std::size_t nb = d.names.size(), nt = d.time.size();
  const std::size_t each = 12 + 8 + 4 + 4;
  const std::size_t budget =
      std::clamp<std::size_t>(pose_budget / std::max<std::size_t>(1, each * nb), 2, 3000);
  const std::vector<std::size_t> frames =
      nt == 0 ? std::vector<std::size_t>{} : pick_frames(d.time, budget, d.windows);
  std::vector<double> time;
  std::vector<float> speed, kinetic;
  std::vector<double> position;
  std::vector<std::int16_t> orientation;
  const std::string g = "/history/blocks/";
  RowReader xs(d.file, g + "position", 3 * nb), qs(d.file, g + "orientation", 4 * nb),
      vs(d.file, g + "velocity", 3 * nb);
  RowReader translational(d.file, g + "kinetic_translational", nb),
      rotational(d.file, g + "kinetic_rotational", nb);
  for (const std::size_t k : frames) {
    time.push_back(d.time[k]);
    if (nb == 0) continue;
    const auto x = xs.row(k), q = qs.row(k), v = vs.row(k), e1 = translational.row(k), e2 = rotational.row(k);
    position.insert(position.end(), x.begin(), x.end());
    for (const double c : q)
      orientation.push_back(std::isfinite(c)
                                ? static_cast<std::int16_t>(std::lround(32767 * std::clamp(c, -1.0, 1.0)))
                                : std::int16_t{0});
    for (std::size_t b = 0; b < nb; ++b) {
      speed.push_back(static_cast<float>(std::hypot(v[3 * b], v[3 * b + 1], v[3 * b + 2])));
      kinetic.push_back(static_cast<float>(e1[b] + e2[b]));
    }
  }
  // The view holds what counts, with the blocks' own size, not the fall of what left the model.
  const std::vector<double> radii = radii_of_blocks(d);
  const json blocks = d.summary.value("blocks", json::array());
  for (std::size_t i = 0; i + 2 < position.size(); i += 3) {
    const std::size_t b = i / 3 % nb, k = i / 3 / nb;
    const bool left = b < blocks.size() && blocks[b].contains("left") && blocks[b]["left"].is_number() &&
                      time[k] > blocks[b]["left"].get<double>();
    if (!left && std::isfinite(position[i]))
      extend(d.region, Vec3(position[i], position[i + 1], position[i + 2]), radii[b]);
  }
  d.block_positions = std::move(position);
  d.blob.add("frame_time", time, {time.size()});
  d.blob.add("frame_orientation", orientation, {time.size(), nb, 4});
  d.blob.add("frame_speed", speed, {time.size(), nb});
  d.blob.add("frame_kinetic", kinetic, {time.size(), nb});
  d.frames = time.size();
}

void add_shapes(ReportData& d) {
  const std::string g = "/geometry/blocks/";
  const auto v = d.file.read<double>(g + "vertices");
  const auto t = d.file.read<std::int32_t>(g + "triangles");
  const auto narrow = [&](const char* name) {
    const auto a = d.file.read<std::int64_t>(g + name);
    d.blob.add(std::string("block_") + name, std::vector<std::uint32_t>(a.values.begin(), a.values.end()),
               {a.values.size()});
  };
  d.blob.add("block_vertices", std::vector<float>(v.values.begin(), v.values.end()), {v.rows(), 3});
  d.blob.add("block_triangles", std::vector<std::uint32_t>(t.values.begin(), t.values.end()), {t.rows(), 3});
  narrow("vertex_offset");
  narrow("triangle_offset");
}

}  // namespace talus::io
