/// One function a command; each returns the exit code and throws InputError for bad input (exit code 2).
#pragma once
#include "app/cli.hpp"
#include "sim/simulation.hpp"

namespace talus::app {

int command_run(const Options& options);
int command_check(const Options& options);
int command_cut(const Options& options);
int command_impact(const Options& options);
int command_capacity(const Options& options);
int command_verify(const Options& options);
int command_formulas(const Options& options);
int command_report(const Options& options);
int command_convert(const Options& options);
int command_explain(const Options& options);
int command_ensemble(const Options& options);
int command_fragility(const Options& options);
int command_compare(const Options& options);
int command_calibrate(const Options& options);

/// Runs a scene that has been read; the common part of run and impact. `carry_blocks`: with
/// simulation.initial_state blocks go on from there, too, not structures alone.
int run_scene(scene::Scene scene, const Options& options, bool carry_blocks = true);

/// Starts from another run's end if the scene names one (`initial_state`); `blocks`: not structures alone.
void carry_over(sim::Simulation& simulation, bool blocks);

/// `results/<stem>` of the scene unless -o says otherwise.
std::string output_directory(const Options& options);

}  // namespace talus::app
