/// The command line: one definition that parses, helps, and makes the man page and the shell completion.
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "scene/scene.hpp"

namespace talus::app {

/// Suites of `talus verify`.
inline constexpr const char* verify_suites[] = {"dda", "fem", "coupling", "stability", "invariants"};

enum Exit : int { done = 0, fell_short = 1, bad_input = 2, numerical_failure = 3 };

/// What the user asked for. Every command reads only its own fields.
struct Options {
  std::string input;             // SCENE, DIR, KEY, SUITE, IN
  std::string output;            // -o DIR, OUT
  std::vector<std::string> set;  // KEY=VALUE
  int threads = 0;               // 0: the scene's
  bool resume = false;
  bool quick = false;
  bool lateral = false;  // talus capacity
  bool all = false, markdown = false, tolerances = false;
  bool man = false;
  bool repair = false;  // talus convert
  std::vector<std::string> words;
  // talus fragility, talus calibrate
  std::string structure, window = "0.5 s", measured;
  int runs = 60, candidates = 32;
  bool capacity = false;
  std::vector<std::string> vary;
  // talus formulas
  std::string mass, velocity, diameter, stiffness, angle;

  /// --set and --threads, in order. Throws InputError for a text without "=".
  scene::Overrides overrides() const;
  /// --set alone.
  scene::Overrides scene_overrides(const std::string& example = "simulation.step=\"1e-4 s\"") const;
};

std::unique_ptr<CLI::App> make_cli(Options& options);

std::string man_page(const CLI::App& app);
/// "bash", "zsh" or "fish". Throws InputError for another one.
std::string completion(const CLI::App& app, const std::string& shell);

}  // namespace talus::app
