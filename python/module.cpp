/// The extension of `import talus`: checks and runs scenes in this process. Arguments and results are plain
/// texts, numbers and lists; the package (talus/__init__.py) makes objects of them.
#include "core/module.hpp"

#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <optional>

#include "app/commands.hpp"
#include "app/record_run.hpp"
#include "app/run_checkpoint.hpp"
#include "app/scene_hash.hpp"
#include "io/report.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace py = pybind11;
namespace fs = std::filesystem;

namespace talus::python {
namespace {

/// Records a run and calls Python between macro steps, so that a signal (Ctrl-C) or an exception of the
/// callback stops it with its state saved.
class PythonSink : public app::RecordingSink {
 public:
  PythonSink(io::Recorder& recorder, std::string hash, const py::object& callback, std::atomic<int>& stop)
      : RecordingSink(recorder, std::move(hash)), callback_(callback), stop_(stop) {}

  void progress(double time, double duration, const sim::RunCounters&, double) override {
    if (stop_.load() != 0) return;
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) return keep(py::error_already_set());
    if (callback_.is_none()) return;
    try {
      callback_(time, duration);
    } catch (py::error_already_set& error) { keep(std::move(error)); }
  }
  void warning(const std::string& text) override { RecordingSink::warning(text); }
  /// Raises what stopped the run, if Python did. With the lock held.
  void raise() {
    if (raised_) throw std::move(*raised_);
  }

 private:
  void keep(py::error_already_set error) {
    raised_.emplace(std::move(error));
    stop_.store(SIGINT);
  }
  py::object callback_;
  std::atomic<int>& stop_;
  std::optional<py::error_already_set> raised_;
};

/// talus.SceneError with every problem.
[[noreturn]] void raise_problems(const InputError& error) {
  py::list problems;
  for (const Problem& p : error.problems()) {
    py::dict d;
    d["severity"] = p.severity == Problem::Severity::error ? "error" : "warning";
    d["file"] = p.file, d["line"] = p.line, d["column"] = p.column, d["key"] = p.key, d["value"] = p.value,
    d["rule"] = p.rule, d["remedy"] = p.remedy, d["text"] = p.str();
    problems.append(d);
  }
  const py::object type = py::module_::import("talus.errors").attr("SceneError");
  PyErr_SetObject(type.ptr(), type(problems).ptr());
  throw py::error_already_set();
}

scene::Scene read(const std::string& scene, bool is_text, const scene::Overrides& overrides) {
  return is_text ? scene::read_scene_text(scene, (fs::current_path() / "scene.toml").string(), overrides)
                 : scene::read_scene(scene, overrides);
}

py::dict check(const std::string& text, bool is_text, const scene::Overrides& overrides) try {
  std::string title;
  std::vector<std::string> plan, warnings;
  {
    const py::gil_scoped_release release;
    sim::Simulation simulation(read(text, is_text, overrides));
    app::carry_over(simulation, true);
    title = simulation.header().title;
    plan = simulation.plan();
    for (const Problem& warning : simulation.warnings()) warnings.push_back(warning.str());
  }
  py::dict out;
  out["title"] = title, out["plan"] = plan, out["warnings"] = warnings;
  return out;
} catch (const InputError& error) { raise_problems(error); }

py::dict run(const std::string& text, bool is_text, const scene::Overrides& overrides,
             const std::string& output, bool resume, bool report, const py::object& progress) try {
  const fs::path directory = output;
  sim::RunResult result;
  std::atomic<int> stop{0};
  std::optional<PythonSink> sink;
  {
    const py::gil_scoped_release release;
    scene::Scene scene = read(text, is_text, overrides);
    io::check_directory(directory, io::Results::run);
    std::vector<fs::path> inputs;
    for (const auto& [path, hash] : scene.files) inputs.emplace_back(path);
    io::spare_inputs(directory, inputs);
    const io::RecorderOptions recording{directory, is_text ? std::string() : scene.file, scene.resolved_json,
                                        true};
    const std::string hash = app::scene_hash(scene.resolved_json);
    const bool wants_report = report && scene.output.report;
    sim::Simulation simulation(std::move(scene));
    app::carry_over(simulation, true);
    std::optional<io::Recorder> recorder;
    if (resume && fs::exists(directory / app::checkpoint_name)) {
      app::require_same_scene(directory, hash);
      const app::StoredRun stored = app::load_run(directory / app::checkpoint_name, hash);
      simulation.restore(stored.state);
      recorder.emplace(recording, stored.journal_position);
    } else {
      recorder.emplace(recording, simulation.header());
    }
    {
      const py::gil_scoped_acquire lock;
      sink.emplace(*recorder, hash, progress, stop);
    }
    result = app::record_run(simulation, *recorder, *sink, &stop).result;
    if (wants_report && stop.load() == 0) io::write_report(directory);
  }
  sink->raise();
  py::dict out;
  out["status"] = result.status, out["message"] = result.message, out["exit_code"] = result.exit_code;
  return out;
} catch (const InputError& error) { raise_problems(error); } catch (const io::WriteError& error) {
  PyErr_SetString(PyExc_OSError, error.what());
  throw py::error_already_set();
}

}  // namespace
}  // namespace talus::python

PYBIND11_MODULE(_talus, m) {
  using namespace talus;
  m.attr("version") = TALUS_VERSION;
  m.def("add_module_directory", [](const std::string& directory) { add_module_directory(directory); });
  m.def("check", &python::check, py::arg("scene"), py::arg("is_text"), py::arg("overrides"));
  m.def("run", &python::run, py::arg("scene"), py::arg("is_text"), py::arg("overrides"), py::arg("output"),
        py::arg("resume"), py::arg("report"), py::arg("progress"));
}
