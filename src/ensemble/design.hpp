/// What each member draws.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ensemble/distribution.hpp"
#include "ensemble/sobol.hpp"
#include "geometry/terrain.hpp"
#include "scene/scene.hpp"

namespace talus::scene {
struct Key;
}

namespace talus::ensemble {

/// A column of results: numbers, or texts.
struct Column {
  std::string name;  // the key
  int width = 1;     // numbers a member
  bool text = false;
  std::string unit, description;
};

/// The values of one member.
struct Draw {
  scene::Overrides set;                      // what makes the member's scene of the common one
  std::vector<std::vector<double>> numbers;  // per column; empty for a text
  std::vector<std::string> texts;            // per column; empty for numbers
};

/// Whether there is ground below a place in plan, scene coordinates.
using OverGround = std::function<bool(double x, double y)>;

class Design {
 public:
  /// Throws InputError for variables that cannot be.
  Design(const scene::Ensemble& ensemble, const scene::Template& scene);
  Design(Design&&) noexcept;
  ~Design();

  /// Members that are asked for at most.
  long members() const { return members_; }
  const std::vector<Column>& columns() const { return columns_; }
  /// Changes that every scene takes before the first place is drawn: it can be read, its blocks lie nowhere.
  scene::Overrides provisional() const;
  /// From here on releases are drawn, over ground. Warnings for areas of which a part has none below. Throws
  /// InputError for an area without any.
  std::vector<Problem> place(const scene::Scene& provisional, std::string& crs, OverGround ground);
  /// What each variable draws, a line each: of numbers the 5th, 50th and 95th percentile of the first
  /// members.
  std::vector<std::string> plan() const;
  Draw draw(long index) const;
  std::uint64_t seed_of(long index) const;
  /// One sentence for each variable that gave values that its key forbids among the first members, with how
  /// many.
  std::vector<Problem> forbidden(long members, const std::string& file) const;
  /// True if some variable changes a part of the scene: by the user's names ("block.B1.release"), or of any
  /// name ("site", "material.roughness").
  bool varies(const std::string& part) const;

 private:
  struct Variable;
  double coordinate(long index, int dimension) const;
  void draw_number(const Variable& v, long index, Draw& draw) const;
  void draw_release(const Variable& v, long index, Draw& draw) const;
  const Variable* find(const std::string& key) const;
  std::string percentiles_of(const Variable& v) const;
  std::string whole_numbers(const Variable& v) const;

  scene::Ensemble ensemble_;
  std::vector<Variable> variables_;
  std::vector<Column> columns_;
  std::unique_ptr<Sobol> sobol_;
  OverGround ground_;
  Vec3 origin_ = Vec3::Zero();
  long members_ = 0, combinations_ = 1;
};

}  // namespace talus::ensemble
