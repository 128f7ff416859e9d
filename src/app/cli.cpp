#include "app/cli.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "scene/keys.hpp"

namespace talus::app {
namespace {

void scene_options(CLI::App& command, Options& options) {
  command.add_option("SCENE", options.input, "Scene file (TOML, or scene.resolved.json)")->required();
  command
      .add_option("--set", options.set,
                  "Set a key of the scene, e.g. --set simulation.step=\"1e-4 s\"; may be repeated")
      ->type_name("KEY=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  command.add_option("--threads", options.threads, "Threads; 0 takes all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));
}

void run_options(CLI::App& command, Options& options) {
  scene_options(command, options);
  command.add_option("-o,--output", options.output, "Output directory (results/<scene's stem>)")
      ->type_name("DIR");
  command.add_flag("--resume", options.resume, "Go on from the last checkpoint in the output directory");
}

}  // namespace

scene::Overrides Options::overrides() const {
  scene::Overrides pairs = scene_overrides();
  if (threads > 0) pairs.emplace_back("simulation.threads", std::to_string(threads));
  return pairs;
}

scene::Overrides Options::scene_overrides(const std::string& example) const {
  scene::Overrides pairs;
  for (const std::string& text : set) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      Problem problem;
      problem.file = "--set";
      problem.key = text;
      problem.rule = "must be KEY=VALUE";
      problem.remedy = "write for example --set " + example;
      throw InputError(problem);
    }
    pairs.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return pairs;
}

std::unique_ptr<CLI::App> make_cli(Options& options) {
  auto app = std::make_unique<CLI::App>(
      "Rockfall and structural impact: blocks that slide, roll and strike, structures that bend, crack and "
      "come apart.",
      "talus");
  app->set_version_flag("--version", TALUS_VERSION, "Print the version");
  app->set_help_all_flag("--help-all", "Print the help of every command");
  app->add_flag("--man", options.man, "Print the manual page");
  app->add_option("--completion", "Print a completion script for bash, zsh or fish")
      ->type_name("SHELL")
      ->expected(1);
  app->require_subcommand(0, 1);
  app->fallthrough(false);
  app->footer(
      "Exit codes: 0 done, 1 a check fell short, 2 bad input or usage (nothing written), 3 numerical failure "
      "(state saved), 130, 143 or 129 interrupted (state saved).");

  run_options(*app->add_subcommand("run", "Run a scene"), options);
  scene_options(
      *app->add_subcommand(
          "check",
          "Report every error of a scene at once, or what will be computed, what is left out and why"),
      options);

  auto* cut = app->add_subcommand("cut", "Cut the rock mass alone: blocks as files, volumes, stereonet");
  scene_options(*cut, options);
  cut->add_option("-o,--output", options.output, "Output directory")->type_name("DIR")->required();

  run_options(*app->add_subcommand("impact", "A structure alone, hit by the block of the scene's [impact]"),
              options);

  auto* capacity = app->add_subcommand(
      "capacity",
      "Residual capacity of the piers from the final state: axial by push-down, beside EN 1992-1-1");
  capacity->add_option("DIR", options.input, "Output directory of a run")->required();
  capacity->add_flag("--lateral", options.lateral,
                     "Push every pier sideways, too, along both axes of its section");

  auto* verify =
      app->add_subcommand("verify", "Verification and stability suites; exit code 1 if any case falls short");
  verify->add_option("SUITE", options.input, "dda, fem, coupling, stability or invariants; all if omitted");
  verify->add_flag("--quick", options.quick, "The short cases only");
  verify->add_option("-o,--output", options.output, "Directory for verify.html, verify.json and plots")
      ->type_name("DIR");

  auto* formulas = app->add_subcommand("formulas", "The design formulas for a block, without a run");
  formulas->add_option("--mass", options.mass, "Mass of the block, e.g. 5t")->required();
  formulas->add_option("--velocity", options.velocity, "Its velocity, e.g. \"25 m/s\"")->required();
  formulas->add_option("--diameter", options.diameter,
                       "Its diameter; omitted: that of a sphere of 2600 kg/m^3");
  formulas->add_option("--set", options.set, "Further inputs of the formulas")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);

  app->add_subcommand("report", "Write report.html of an output directory: one file that opens offline")
      ->add_option("DIR", options.input, "Output directory of a run")
      ->required();

  auto* convert =
      app->add_subcommand("convert", "Convert between formats, e.g. results.h5#/history/blocks to CSV");
  convert->add_option("IN", options.input, "What to convert")->required();
  convert->add_option("OUT", options.output, "Where to")->required();
  convert->add_flag("--repair", options.repair,
                    "Surface meshes: weld, turn outward, fill holes, and tell what was done");

  auto* explain =
      app->add_subcommand("explain", "What a scene key means: type, unit, default, range, source");
  explain->add_option("KEY", options.input, "Key, e.g. block.size or simulation");
  explain->add_flag("--all", options.all, "List all keys");
  explain->add_flag("--markdown", options.markdown, "With --all: the reference as Markdown");
  explain->add_flag("--tolerances", options.tolerances,
                    "The tolerances of contact and of a step, as Markdown");

  auto* ensemble = app->add_subcommand("ensemble",
                                       "Many members of a scene that differ in what its [ensemble] draws; "
                                       "under mpirun they are handed to all ranks");
  scene_options(*ensemble, options);
  ensemble->add_option("-o,--output", options.output, "Output directory")->type_name("DIR")->required();
  ensemble->add_flag("--resume", options.resume, "Go on with the members that are not finished");

  auto* fragility = app->add_subcommand(
      "fragility",
      "From an ensemble's hits on a structure to probabilities of damage, by coupled runs of some of them");
  fragility->add_option("DIR", options.input, "Output directory of talus ensemble")->required();
  fragility->add_option("--structure", options.structure, "The structure")->type_name("NAME")->required();
  fragility->add_option("--runs", options.runs, "Coupled runs (60)")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
  fragility
      ->add_option("--window", options.window,
                   "Time of the strike and what follows that each run covers (0.5 s)")
      ->type_name("TIME");
  fragility->add_flag(
      "--capacity", options.capacity,
      "Push the structure's members down at the end of each run: what is left of their capacity");
  fragility->add_option("--threads", options.threads, "Runs at a time; 0 takes all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));

  auto* compare =
      app->add_subcommand("compare", "Ensembles of options side by side: differences with intervals");
  compare
      ->add_option("DIR", options.words,
                   "Output directories of talus ensemble; the first is what the others are held against")
      ->required()
      ->expected(2, 1000);
  compare
      ->add_option("-o,--output", options.output,
                   "Directory for compare.json and compare.html (results/compare)")
      ->type_name("DIR");

  auto* calibrate = app->add_subcommand(
      "calibrate", "Parameters of a scene with [ensemble] against measured end points or passages");
  scene_options(*calibrate, options);
  calibrate
      ->add_option("--measured", options.measured,
                   "CSV file: columns x and y of end points, scene coordinates; or a column line and some of "
                   "energy, speed, height of passages there. Every fourth row is held out")
      ->type_name("FILE")
      ->required();
  calibrate->add_option("--vary", options.vary, "A parameter and its range; may be repeated")
      ->type_name("KEY=LOW:HIGH")
      ->required()
      ->take_all()
      ->allow_extra_args(false);
  calibrate->add_option("--candidates", options.candidates, "Points of the range that are tried (32)")
      ->type_name("N")
      ->check(CLI::Range(2, 10000));
  calibrate->add_option("-o,--output", options.output, "Output directory")->type_name("DIR")->required();
  return app;
}

namespace {

std::string roff(std::string text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

std::string option_name(const CLI::Option& option) {
  std::string name = option.get_positional() ? option.get_name(true) : option.get_name(false, true);
  // The type's name goes on with the range that is checked.
  const std::string type = option.get_type_name().substr(0, option.get_type_name().find(':'));
  if (!option.get_positional() && !type.empty() && option.get_expected_max() > 0)
    name += " " + (type == "TEXT" ? std::string("VALUE") : type);
  return name;
}

}  // namespace

std::string man_page(const CLI::App& app) {
  std::string text = fmt::format(
      ".TH TALUS 1 \"\" \"Talus {}\" \"Talus\"\n.SH NAME\ntalus \\- coupled simulation of rock blocks and "
      "structures\n.SH SYNOPSIS\n.B talus\n.I command\n[options]\n",
      TALUS_VERSION);
  text += ".SH DESCRIPTION\n" + roff(app.get_description()) + "\n.SH COMMANDS\n";
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    std::string line = "talus " + command->get_name();
    for (const CLI::Option* option : command->get_options())
      if (option->get_positional())
        line += option->get_required() ? " " + option->get_name(true) : " [" + option->get_name(true) + "]";
    text += ".SS " + roff(line) + "\n" + roff(command->get_description()) + ".\n";
    for (const CLI::Option* option : command->get_options())
      if (option->get_name(false, true).find("--help") == std::string::npos)
        text += ".TP\n.B " + roff(option_name(*option)) + "\n" + roff(option->get_description()) + "\n";
  }
  text += ".SH OPTIONS\n";
  for (const CLI::Option* option : app.get_options())
    text += ".TP\n.B " + roff(option_name(*option)) + "\n" + roff(option->get_description()) + "\n";
  text +=
      ".SH EXIT STATUS\n.TP\n.B 0\ndone\n.TP\n.B 1\na check fell short\n.TP\n.B 2\nbad input or usage; "
      "nothing was written\n.TP\n.B 3\nnumerical failure; the state was saved\n.TP\n.B 130, 143, 129\n"
      "interrupted by SIGINT, SIGTERM or SIGHUP; the state was saved\n";
  text += ".SH FILES\nA scene is a TOML file; its keys are listed by\n.BR \"talus explain \\-\\-all\" .\n";
  return text;
}

std::string completion(const CLI::App& app, const std::string& shell) {
  std::string commands;
  std::string cases, fish;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands += (commands.empty() ? "" : " ") + command->get_name();
    std::string names;
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames()) {
        names += (names.empty() ? "--" : " --") + name;
        fish += fmt::format(
            "complete -c talus -n '__fish_seen_subcommand_from {}' -l {} -d \"{}\"\n", command->get_name(),
            name, option->get_description().substr(0, option->get_description().find_first_of(";\"")));
      }
    if (command->get_name() == "explain")
      for (const std::string& key : scene::all_keys()) names += " " + key;
    if (command->get_name() == "verify") names += fmt::format(" {}", fmt::join(verify_suites, " "));
    cases += fmt::format("    {}) words=\"{}\" ;;\n", command->get_name(), names);
    fish +=
        fmt::format("complete -c talus -n __fish_use_subcommand -a {} -d \"{}\"\n", command->get_name(),
                    command->get_description().substr(0, command->get_description().find_first_of(";\"")));
  }
  const std::string bash = fmt::format(
      "_talus() {{\n  local words=\"{} --version --help\" current=\"${{COMP_WORDS[COMP_CWORD]}}\"\n  "
      "COMPREPLY=()\n  if [ \"$COMP_CWORD\" -gt 1 ]; then\n    case \"${{COMP_WORDS[1]}}\" in\n{}    esac\n  "
      "fi\n"
      "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n  [ ${{#COMPREPLY[@]}} -eq 0 ] && "
      "COMPREPLY=($(compgen -f -- \"$current\"))\n}}\ncomplete -o filenames -F _talus talus\n",
      commands, cases);
  if (shell == "bash") return bash;
  if (shell == "zsh") return "#compdef talus\nautoload -U +X bashcompinit && bashcompinit\n" + bash;
  if (shell == "fish") return fish;
  Problem problem;
  problem.key = "--completion";
  problem.value = shell;
  problem.rule = "must be bash, zsh or fish";
  problem.remedy = "choose one of these";
  throw InputError(problem);
}

}  // namespace talus::app
