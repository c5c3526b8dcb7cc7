// SPDX-License-Identifier: GPL-3.0-or-later
#include "options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>
#include <vector>

#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/io/nearest_name.hpp"
#include "radiosity/simulation/choose_method.hpp"
#include "radiosity/simulation/elements.hpp"
#include "radiosity/simulation/probe.hpp"
#include "radiosity/solver/solver.hpp"

namespace radiosity::app {
namespace {

using Check = std::function<std::string(const std::string&)>;  // an empty answer means: good

template <class Number>
std::optional<Number> parse_number(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

std::optional<double> parse_finite(const std::string& text) {
  const auto value = parse_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string finite(const std::string& text) {
  return parse_finite(text) ? "" : fmt::format("'{}' is not a number", text);
}

std::string positive(const std::string& text) {
  const auto value = parse_finite(text);
  return value && *value > 0 ? "" : fmt::format("'{}' is not a number above 0", text);
}

// From a byte to 10^18 of them, which a size_t holds.
std::string gigabytes(const std::string& text) {
  const auto value = parse_finite(text);
  return value && *value >= 1e-9 && *value <= 1e9
             ? ""
             : fmt::format("'{}' is not a number from 1e-9 to 1e9", text);
}

template <class Whole>
Check whole(Whole least, Whole most) {
  return [least, most](const std::string& text) -> std::string {
    const auto value = parse_number<Whole>(text);
    if (value && *value >= least && *value <= most) return "";
    return fmt::format("'{}' is not a whole number from {} to {}", text, least, most);
  };
}

std::string relaxation(const std::string& text) {
  const auto value = parse_finite(text);
  return value && *value > 0 && *value < 2 ? "" : fmt::format("'{}' is not a number between 0 and 2", text);
}

std::string field_of_view(const std::string& text) {
  const auto value = parse_finite(text);
  return value && *value > 0 && *value < 180
             ? ""
             : fmt::format("'{}' is not an angle between 0 and 180 degrees", text);
}

Check one_of(std::string kind, std::vector<std::string> names) {
  return [kind = std::move(kind), names = std::move(names)](const std::string& text) -> std::string {
    if (std::find(names.begin(), names.end(), text) != names.end()) return "";
    return fmt::format("unknown {} '{}'{} Known: {}", kind, text, did_you_mean(text, names),
                       fmt::join(names, ", "));
  };
}

std::string size_or_word(const std::string& text) {
  if (text == "none" || text == "auto" || positive(text).empty()) return "";
  return fmt::format("'{}' is neither 'none' nor 'auto' nor a length in metres above 0", text);
}

template <class Options, class None, class Auto, class Size>
Options to_size(const std::string& text) {
  if (text == "none") return None{};
  if (text == "auto") return Auto{};
  return Size{*parse_finite(text)};
}
constexpr auto to_patch_options = to_size<PatchOptions, KeepFaces, AutoPatches, PatchSize>;
constexpr auto to_element_options = to_size<ElementOptions, NoElements, AutoElements, ElementSize>;

// "hemisphere 1024, analytic 16": the defaults of the methods that this option sets.
std::string defaults_of(Index FormFactorOptions::*setting) {
  std::vector<std::string> defaults;
  for (const auto& method : form_factor_methods())
    if (method.defaults.*setting > 0)
      defaults.push_back(fmt::format("{} {}", method.name, method.defaults.*setting));
  return fmt::format("{}", fmt::join(defaults, ", "));
}

// "1,2.5,4": finite numbers. Nothing where one is not.
std::optional<std::vector<double>> parse_list(const std::string& text) {
  std::vector<double> values;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto value = parse_finite(part);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

std::string range(const std::string& text) {
  const auto values = parse_list(text);
  return values && values->size() == 2 && (*values)[0] < (*values)[1]
             ? ""
             : fmt::format("'{}' is not MIN,MAX: two numbers, the second above the first", text);
}

constexpr int kMostIsolines = 100;

std::string isolines(const std::string& text) {
  if (text.find(',') == std::string::npos) {
    const auto count = parse_number<int>(text);
    if (count && *count >= 1 && *count <= kMostIsolines) return "";
  } else if (const auto values = parse_list(text); values && !values->empty()) {
    return "";
  }
  return fmt::format("'{}' is neither a whole number from 1 to {} nor values with commas between them", text,
                     kMostIsolines);
}

constexpr std::size_t kColumn = 34, kTextWidth = 66;  // of --help

// Breaks lines between words; `indent` spaces begin all but the first.
std::string wrap(const std::string& text, std::size_t indent) {
  std::istringstream words(text);
  std::string result;
  std::size_t column = indent;
  for (std::string word; words >> word; column += word.size()) {
    if (result.empty()) {
    } else if (column + 1 + word.size() <= kTextWidth) {
      result += ' ';
      ++column;
    } else {
      result += '\n' + std::string(indent, ' ');
      column = indent;
    }
    result += word;
  }
  return result;
}

template <class Info>
std::string table(std::span<const Info> rows) {
  std::string text;
  for (const Info& row : rows)
    text += fmt::format("\n  {:<23}{}", row.name, wrap(std::string(row.summary), 25));
  return text;
}

template <class Info>
std::vector<std::string> names(std::span<const Info> rows) {
  std::vector<std::string> result;
  for (const Info& row : rows) result.emplace_back(row.name);
  return result;
}

// CLI11's own layout with exactly one blank line between the parts.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    label("SUBCOMMAND", "COMMAND ...");
    label("Positionals", "Argument");
    column_width(kColumn);
  }
  std::string make_usage(const CLI::App* app, std::string name) const override {
    return "\n" + Formatter::make_usage(app, std::move(name));
  }
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    return CLI::detail::find_and_replace(Formatter::make_help(app, std::move(name), mode), "\n\n\n", "\n\n");
  }
};

constexpr Index kMaxIndex = std::numeric_limits<Index>::max();

class Parser {
 public:
  explicit Parser(Options& options) : options_(options) {
    app_.set_help_flag("-h,--help", "Print this help");
    app_.set_version_flag("--version", "radiosity " RADIOSITY_VERSION, "Print the version");
    app_.require_subcommand(1);
    app_.formatter(std::make_shared<HelpFormatter>());
    app_.footer(
        "radiosity COMMAND --help tells more about one. A first run:\n"
        "  radiosity solve scenes/cornell-box.toml -o cornell-box.vtp\n\n"
        "Exit status: 0 done; 1 bad input or files; 2 bad usage; 3 stopped before the tolerance was reached\n"
        "(what had been reached is written).");
    add_solve();
    add_factors();
    add_inspect();
    add_view();
    add_probe();
    add_compare();
  }

  /// False when help or version was printed.
  bool parse(int argc, char** argv) {
    try {
      app_.parse(argc, argv);
    } catch (const CLI::Success& e) {
      app_.exit(e);
      return false;
    } catch (const CLI::ParseError& e) {
      explain_unknown_arguments();
      if (app_.get_subcommands().empty())
        throw UsageError(fmt::format("no command; give one of {} (radiosity --help tells more)",
                                     fmt::join(commands(), ", ")));
      if (dynamic_cast<const CLI::ArgumentMismatch*>(&e) != nullptr) explain_number_of_values(e.what());
      throw UsageError(e.what());
    }
    for (const CLI::App* command : app_.get_subcommands()) options_.command = command->get_name();
    explain_settings_without_effect();
    return true;
  }

 private:
  CLI::App* add_command(const std::string& name, const std::string& description, const std::string& scene) {
    CLI::App* command = app_.add_subcommand(name, description);
    command->group("Commands");
    command->add_option("SCENE", options_.scene, scene)->required()->option_text(" ");
    return command;
  }

  static CLI::Option* add_checked(CLI::Option* option, const std::string& text, const Check& check) {
    option->option_text(text);
    if (check) option->check(check);
    return option;
  }

  void add_output(CLI::App* command, const std::string& text, const std::string& description) {
    command->add_option("-o,--output", options_.output, description)
        ->required()
        ->option_text(text)
        ->group("Files");
  }

  void add_report(CLI::App* command) {
    command->add_option("--report", options_.report_file, "What was done, as JSON, in SI units")
        ->option_text("FILE.json")
        ->group("Files");
  }

  void add_patches(CLI::App* command) {
    add_checked(command->add_option_function<std::string>(
                    "--patch-size",
                    [this](const std::string& text) { options_.flags.patches = to_patch_options(text); },
                    fmt::format("Longest edge of a patch in m, smaller faces are joined to\n"
                                "clusters; none: every face is one patch; auto: about {}\n"
                                "patches, whatever the number of faces. Default: auto",
                                AutoPatches{}.target)),
                "METRES|none|auto", size_or_word)
        ->group("Patches");
  }

  void add_elements(CLI::App* command) {
    const std::string group = "Elements";
    add_checked(command->add_option_function<std::string>(
                    "--element-size",
                    [this](const std::string& text) { options_.flags.elements = to_element_options(text); },
                    "Longest edge in m of the pieces of patches for which light is\n"
                    "gathered once more: patches carry it, elements show it, sharp\n"
                    "shadows included; auto: small where light changes, and only\n"
                    "there; none: the patches show it. Default: none"),
                "METRES|none|auto", size_or_word)
        ->group(group);
    add_checked(command->add_option("--element-samples", options_.flags.element_samples,
                                    fmt::format("Rays per element. Default: {}", ElementGather{}.samples)),
                "N", whole<Index>(1, 1 << 20))
        ->group(group);
  }

  void add_form_factors(CLI::App* command, bool with_method) {
    const std::string group = "Form factors";
    if (with_method) {
      auto known = names(form_factor_methods());
      known.emplace_back(kAutoMethod);
      add_checked(
          command->add_option("--method", options_.flags.method,
                              fmt::format("Default: {}, one of these by size and shape of the\nscene:{}",
                                          kAutoMethod, table(form_factor_methods()))),
          "NAME", one_of("method", known))
          ->group(group);
    }
    add_checked(
        command->add_option("--samples", options_.flags.samples,
                            fmt::format("Rays per patch (hemisphere), viewpoints per patch (hemicube;\n"
                                        "1 is the centre), or points or shadow rays per partly hidden\n"
                                        "pair (analytic). Default: {}",
                                        defaults_of(&FormFactorOptions::samples))),
        "N", whole<Index>(1, kMaxIndex))
        ->group(group);
    add_checked(command->add_option("--resolution", options_.flags.resolution,
                                    fmt::format("Cells along an edge of the hemicube's top.\nDefault: {}",
                                                defaults_of(&FormFactorOptions::resolution))),
                "N", whole<Index>(1, kMaxIndex))
        ->group(group);
    add_checked(command->add_option("--factor-tolerance", options_.flags.factor_tolerance,
                                    fmt::format("Typical relative error of the factor of two patches that\n"
                                                "nothing stands between (analytic). Default: {:g}",
                                                kFactorTolerance)),
                "T", positive)
        ->group(group);
    add_seed(command, group);
  }

  void add_seed(CLI::App* command, const std::string& group) {
    add_checked(
        command->add_option("--seed", options_.flags.seed,
                            fmt::format("Of the random numbers. Default: {}", FormFactorOptions{}.seed)),
        "N", whole<std::uint64_t>(0, std::numeric_limits<std::uint64_t>::max()))
        ->group(group);
  }

  void add_storage(CLI::App* command) {
    const std::string group = "Form factors";
    command
        ->add_flag_callback(
            "--no-closure", [this] { options_.close = false; },
            "Leave the rows as the method made them: restore neither\nreciprocity nor closure")
        ->option_text(" ")
        ->group(group);
    add_memory_limit(command);
  }

  void add_memory_limit(CLI::App* command) {
    add_checked(command->add_option_function<double>(
                    "--memory-limit",
                    [this](double gb) { options_.memory_limit_bytes = static_cast<std::size_t>(1e9 * gb); },
                    "Most memory that the form factors may take, in GB (10^9\n"
                    "bytes). Default: the memory of this machine"),
                "GB", gigabytes)
        ->group("Form factors");
  }

  void add_solver(CLI::App* command) {
    const std::string group = "Solver";
    add_checked(command->add_option("--solver", options_.flags.solver,
                                    fmt::format("Default: {}{}", kDefaultSolver, table(solvers()))),
                "NAME", one_of("solver", names(solvers())))
        ->group(group);
    add_checked(command->add_option("--tolerance", options_.flags.tolerance,
                                    fmt::format("Share of the emitted power that may be left unaccounted\n"
                                                "for (no unit). Default: {}",
                                                SolverOptions{}.tolerance)),
                "T", positive)
        ->group(group);
    add_checked(command->add_option("--max-iterations", options_.flags.max_iterations,
                                    "Passes over all patches, or shots. Default: the solver's own"),
                "N", whole<Index>(1, kMaxIndex))
        ->group(group);
    add_checked(command->add_option("--relaxation", options_.flags.relaxation,
                                    "Each step of gauss-seidel is taken this many times. Above 1\n"
                                    "it converges faster where reflectances are high. Default: 1"),
                "W", relaxation)
        ->group(group);
    command
        ->add_flag_callback(
            "--ambient", [this] { options_.flags.ambient = true; },
            "Shooting: add the light that is still under way to what\n--series shows, as if it fell evenly "
            "on everything")
        ->group(group);
    command
        ->add_flag_callback(
            "--no-error-estimate", [this] { options_.estimate_error = false; },
            "Do not solve three cheaper problems to tell how far the\nresult is off: about a quarter less "
            "time")
        ->option_text(" ")
        ->group(group);
  }

  void add_accuracy(CLI::App* command) {
    const std::string group = "Accuracy";
    CLI::Option* accuracy =
        add_checked(command->add_option("--accuracy", options_.accuracy,
                                        "Choose method, samples, patch size and tolerance so that the\n"
                                        "estimated error of the reflected light (rms) is at most this"),
                    "PERCENT", positive);
    accuracy->group(group);
    for (const char* chosen : {"--patch-size", "--samples", "--resolution", "--tolerance",
                               "--no-error-estimate", "--no-closure", "--series"})
      accuracy->excludes(command->get_option(chosen));
    add_time_limit(command, group);
  }

  void add_earlier_work(CLI::App* command) {
    const std::string group = "Earlier work";
    CLI::Option* file = command->add_option("--form-factors", options_.form_factor_file,
                                            "Read form factors that radiosity factors made of the same\n"
                                            "patches, instead of computing them");
    file->option_text("F.h5")->group(group);
    CLI::Option* resume = command->add_flag("--resume", options_.resume,
                                            "Go on where an earlier run of the same ended, killed or not:\n"
                                            "the result has the same bits as if it had not");
    resume->disable_flag_override()->option_text(" ")->group(group);
    CLI::Option* every = add_checked(
        command->add_option("--checkpoint", options_.checkpoint_s,
                            fmt::format("Time between savings of the state, in OUT.checkpoint.h5 and,\n"
                                        "of shots and elements, beside it. Default: {}",
                                        options_.checkpoint_s)),
        "SECONDS", positive);
    every->group(group);
    for (const char* made :
         {"--method", "--samples", "--resolution", "--factor-tolerance", "--no-closure", "--accuracy"})
      file->excludes(command->get_option(made));
    for (CLI::Option* option : {file, resume, every}) option->excludes(command->get_option("--accuracy"));
    file->excludes(resume);
  }

  void add_time_limit(CLI::App* command, const std::string& group) {
    add_checked(command->add_option("--time-limit", options_.time_limit,
                                    "Stop after this time with the best there is, as Ctrl-C does"),
                "SECONDS", positive)
        ->group(group);
  }

  void add_general(CLI::App* command) {
    add_checked(command->add_option("--threads", options_.threads,
                                    "Threads to use; no result depends on it.\nDefault: 0, every core"),
                "N", whole<int>(0, 4096))
        ->group("General");
    command->add_flag("--quiet", options_.quiet, "Print nothing but errors")
        ->disable_flag_override()
        ->group("General");
  }

  void add_solve() {
    CLI::App* command = add_command("solve", "Compute the radiosity of every patch of a scene",
                                    "A mesh (.obj .ply .stl .off .gltf .glb .dae .ifc .vtp .vtu)\n"
                                    "or a scene file (.toml) that names one");
    add_output(command, "OUT.vtp|OUT.pvtp",
               "The result, for ParaView (required); .pvtp: in pieces, one of\neach process");
    add_report(command);
    command->add_option("--series", options_.series_file, "Every step of the solver, for ParaView to play")
        ->option_text("FILE.pvd")
        ->group("Files");
    command->add_option("--paraview", options_.paraview_file, "A script that shows the result in ParaView")
        ->option_text("FILE.py")
        ->group("Files");
    add_patches(command);
    add_elements(command);
    add_form_factors(command, true);
    add_storage(command);
    add_solver(command);
    add_accuracy(command);
    add_earlier_work(command);
#ifdef RADIOSITY_MPI
    command
        ->add_option_function<std::string>(
            "--petsc", [this](const std::string& text) { options_.petsc = text; },
            "Solve by conjugate gradients of PETSc, which takes these\noptions, such as '-ksp_monitor'; '' "
            "for none")
        ->option_text("OPTIONS")
        ->group("Solver");
#endif
    add_general(command);
    command->footer("Flags override the scene file. Ctrl-C ends the work and writes what has been reached.");
  }

  void add_factors() {
    CLI::App* command = add_command("factors", "Compute the form factors alone",
                                    "A mesh or a scene file (.toml); needs neither materials nor a lamp");
    add_output(command, "F.mtx|F.h5", "The matrix in Matrix Market format, or in HDF5 (required)");
    add_report(command);
    add_patches(command);
    add_form_factors(command, true);
    add_storage(command);
    add_general(command);
    command->footer(
        "Row i, column j: the fraction of what leaves patch i that arrives at patch j, counted from 1.\n"
        "With --patch-size none row i is face i of the mesh. Flags override the scene file.");
  }

  void add_inspect() {
    CLI::App* command = add_command("inspect", "Tell what is in a scene and what a solve would cost",
                                    "A mesh or a scene file (.toml); needs neither materials nor a lamp");
    add_report(command);
    add_patches(command);
    add_form_factors(command, false);
    add_general(command);
    command->footer("Nothing is solved: a few rows per method are timed to estimate the rest.");
  }

  void add_view() {
    CLI::App* command = add_command("view", "Make an image",
                                    "A solved .vtp or .pvtp, or a scene, which is solved first with the\n"
                                    "settings of its scene file");
    Options::View& view = options_.view;
    add_output(command, "P.png", "The image; .exr and .hdr are in physical units, W/m² (required)");
    command->add_option("--scene", view.camera_file, "A scene file whose [camera] and [lights] are used")
        ->option_text("FILE.toml")
        ->group("Camera");
    command->add_option("--camera", view.camera_name, "The scene file's [camera.NAME]")
        ->option_text("NAME")
        ->group("Camera");
    const auto add_vector = [&](const std::string& name, std::optional<Vec3>& value,
                                const std::string& description) {
      command
          ->add_option_function<std::vector<double>>(
              name, [&value](const std::vector<double>& v) { value = Vec3(v[0], v[1], v[2]); }, description)
          ->expected(3)
          ->option_text("X Y Z")
          ->check(finite)
          ->group("Camera");
    };
    add_vector("--position", view.position, "Where the camera stands, in m");
    add_vector("--target", view.target, "A point in the middle of the image, in m");
    add_vector("--up", view.up, "A direction that is upright in the image. Default: 0 1 0");
    add_checked(
        command->add_option("--fov-deg", view.vertical_fov_deg,
                            fmt::format("Angle from the lower to the upper edge, in degrees.\nDefault: {}",
                                        Camera{}.vertical_fov_deg)),
        "ANGLE", field_of_view)
        ->group("Camera");
    add_checked(command->add_option("--width", view.width, fmt::format("In pixels. Default: {}", view.width)),
                "N", whole<int>(1, 32768))
        ->group("Image");
    add_checked(
        command->add_option("--height", view.height, fmt::format("In pixels. Default: {}", view.height)), "N",
        whole<int>(1, 32768))
        ->group("Image");
    add_checked(command->add_option("--exposure", view.exposure,
                                    "Brightness per radiosity, in 1/(W/m²).\n"
                                    "Default: as it was solved, or chosen from the scene"),
                "X", positive)
        ->group("Image");
    add_checked(command->add_option(
                    "--pipeline", view.pipeline,
                    fmt::format("How the image is made. Default: {}{}", view.pipeline, table(pipelines()))),
                "NAME", one_of("pipeline", names(pipelines())))
        ->group("Image");
    add_checked(command->add_option("--samples", view.samples,
                                    fmt::format("Of each pixel. Default: {}", view.samples)),
                "N", whole<Index>(1, 1 << 20))
        ->group("Image");
    add_seed(command, "Image");
    add_checked(command->add_option("--depth", view.depth,
                                    fmt::format("Of ray-tracing: most surfaces that a ray is followed over.\n"
                                                "Default: {}",
                                                PipelineOptions{}.depth)),
                "N", whole<int>(1, 1 << 20))
        ->group("Image");
    command
        ->add_flag(
            "--classical-attenuation", view.classical_attenuation,
            "Of ray-tracing: mirrored and refracted light falls with the\ndistance, and that of lights is "
            "at most their intensity")
        ->disable_flag_override()
        ->option_text(" ")
        ->group("Image");
    add_checked(command->add_option("--tessellation", view.tessellation,
                                    "Facets of [shapes] are nowhere further from the shape than so many\n"
                                    "pixels. Default: the chord error that the scene file says"),
                "PIXELS", positive)
        ->group("Image");
    add_checked(
        command->add_option("--attenuation-length", view.attenuation_length,
                            "Of gouraud, phong and priority: what is seen falls to 1/e of it over so\n"
                            "many m of air (depth cueing). Default: clear air"),
        "METRES", positive)
        ->group("Image");
    add_time_limit(command, "Image");
    add_false_colour(command);
    add_general(command);
    command->footer(
        "Without --scene and --position the camera is the scene file's own, or one that has all in view.");
  }

  void add_false_colour(CLI::App* command) {
    const std::string group = "False colour";
    Options::View& view = options_.view;
    CLI::Option* array =
        add_checked(command->add_option("--false-colour", view.false_colour,
                                        "Colours for the values of an array of a solved .vtp, such as\n"
                                        "radiosity, irradiance or radiosity_error, with a legend;\n"
                                        ".exr and .hdr hold the values"),
                    "ARRAY", {});
    array->group(group);
    const auto add = [&](CLI::Option* option, const std::string& text, const Check& check) {
      add_checked(option, text, check)->group(group)->needs(array);
    };
    add(command->add_option("--band", view.band,
                            "A band of it, by name or number from 0. Default: their mean"),
        "BAND", {});
    add(command->add_option_function<std::string>(
            "--scale", [&view](const std::string& text) { view.logarithmic = text == "log"; },
            "Of values to colours. Default: linear"),
        "linear|log", one_of("scale", {"linear", "log"}));
    add(command->add_option_function<std::string>(
            "--range",
            [&view](const std::string& text) {
              const auto values = parse_list(text);
              view.range = {(*values)[0], (*values)[1]};
            },
            "Values of the first and the last colour. Default: those of\nwhat is seen"),
        "MIN,MAX", range);
    add(command->add_option_function<std::string>(
            "--isolines",
            [&view](const std::string& text) {
              if (text.find(',') == std::string::npos)
                view.isolines_count = parse_number<int>(text);
              else
                view.isolines = *parse_list(text);
            },
            "Lines of equal value: at N round values at most, or at these;\nfor one alone, a comma after it"),
        "N|V,V...", isolines);
  }

  void add_probe() {
    CLI::App* command = add_command("probe", "Measure irradiance at points",
                                    "A solved .vtp or .pvtp, as radiosity solve\nwrites it");
    add_output(command, "H.csv", "Irradiance and its standard error, in W/m² (required)");
    add_report(command);
    command
        ->add_option("--points", options_.points_file,
                     "The sensors: a line 'x y z nx ny nz' each, position in m\n"
                     "and the direction it faces, of any length; blank lines\n"
                     "and # comments are skipped (required)")
        ->required()
        ->option_text("P.txt")
        ->group("Files");
    const std::string group = "Gathering";
    add_checked(command->add_option(
                    "--samples", options_.flags.samples,
                    fmt::format("Rays per sensor, rounded up to 32 k². Default: {}", ProbeOptions{}.samples)),
                "N", whole<Index>(1, 1 << 20))
        ->group(group);
    add_seed(command, group);
    add_general(command);
    command->footer(
        "Light is gathered afresh at each sensor, with visibility: lamps and near patches by exact factors,\n"
        "the rest by rays. The standard error is that of the rays; the solution's own error comes on top.");
  }

  void add_compare() {
    CLI::App* command = add_command("compare", "Measure the speed and accuracy of every method and solver",
                                    "A mesh or a scene file (.toml)");
    add_output(command, "DIR",
               "Receives trade.csv, trade.json and index.html; made where it\n"
               "does not exist, otherwise empty or of an earlier comparison\n(required)");
    add_checked(command->add_option("--budget", options_.budget_s,
                                    fmt::format("Time for all of it, in s. What does not fit is left out\n"
                                                "and listed. Default: {}",
                                                options_.budget_s)),
                "SECONDS", positive)
        ->group("General");
    add_patches(command);
    add_seed(command, "Form factors");
    add_memory_limit(command);
    add_general(command);
    command->footer(
        "Every method at a ladder of settings on coarser and finer patches, and every solver at tolerances "
        "from\n"
        "0.1 to 1e-8, against a reference whose own error is measured. Open DIR/index.html in a browser.");
  }

  std::vector<std::string> commands() const {
    std::vector<std::string> result;
    for (const CLI::App* command : app_.get_subcommands([](const CLI::App*) { return true; }))
      result.push_back(command->get_name());
    return result;
  }

  // CLI11 complains about whatever it misses first; a name that it does not know is nearly always the cause.
  void explain_unknown_arguments() const {
    const std::vector<std::string> unknown = app_.remaining(true);
    const std::vector<CLI::App*> given = app_.get_subcommands();
    const CLI::App& command = given.empty() ? app_ : *given.front();
    const auto is_option = [](const std::string& argument) {
      return argument.size() > 1 && argument[0] == '-';
    };
    if (given.empty()) {
      // What follows an unknown command was meant for it.
      const auto name = std::find_if_not(unknown.begin(), unknown.end(), is_option);
      if (name != unknown.end())
        throw UsageError(fmt::format("unknown command '{}'{} Known: {}", *name,
                                     did_you_mean(*name, commands()), fmt::join(commands(), ", ")));
    }
    const auto option = std::find_if(unknown.begin(), unknown.end(), is_option);
    if (option != unknown.end()) {
      std::vector<std::string> known;
      for (const CLI::Option* candidate : command.get_options())
        for (const std::string& name : candidate->get_lnames()) known.push_back("--" + name);
      const std::string name = option->substr(0, option->find('='));
      throw UsageError(fmt::format("unknown option '{}'{} (radiosity{} --help lists them all)", name,
                                   did_you_mean(name, known), given.empty() ? "" : " " + command.get_name()));
    }
    if (unknown.empty()) return;
    throw UsageError(
        fmt::format("unexpected argument '{}': {} takes one SCENE", unknown.front(), command.get_name()));
  }

  // CLI11 names the option, then tells how many values of which C++ type it wants.
  void explain_number_of_values(const std::string& message) const {
    const std::string name = message.substr(0, message.find(':'));
    for (const CLI::App* command : app_.get_subcommands())
      for (const CLI::Option* option : command->get_options())
        if (option->check_name(name) && !option->get_option_text().empty())
          throw UsageError(fmt::format("{} takes {}, and is given once", name, option->get_option_text()));
  }

  // A flag that would be ignored is a misunderstanding, so it is refused.
  void explain_settings_without_effect() const {
    if (options_.command == "view") {
      explain_pipeline_settings();
      explain_false_colour_settings();
    }
    if (!options_.flags.method) return;
    const std::string& method = *options_.flags.method;
    const auto refuse = [&](bool given, std::string_view name, auto FormFactorOptions::*setting) {
      if (!given) return;
      std::vector<std::string> users;
      for (const auto& info : form_factor_methods()) {
        if (info.defaults.*setting == 0) continue;
        if (method == kAutoMethod || info.name == method) return;
        users.emplace_back(info.name);
      }
      throw UsageError(fmt::format("--{} has no effect with --method {}; it belongs to {}", name, method,
                                   fmt::join(users, ", ")));
    };
    refuse(options_.flags.samples.has_value(), "samples", &FormFactorOptions::samples);
    refuse(options_.flags.resolution.has_value(), "resolution", &FormFactorOptions::resolution);
    refuse(options_.flags.factor_tolerance.has_value(), "factor-tolerance", &FormFactorOptions::tolerance);
  }

  void explain_pipeline_settings() const {
    const PipelineInfo& used = find_pipeline(options_.view.pipeline);
    const auto refuse = [&](bool given, std::string_view name, bool PipelineInfo::*has) {
      if (!given || used.*has) return;
      std::vector<std::string_view> users;
      for (const PipelineInfo& info : pipelines())
        if (info.*has) users.push_back(info.name);
      throw UsageError(fmt::format("--{} has no effect with --pipeline {}; it belongs to {}", name, used.name,
                                   fmt::join(users, ", ")));
    };
    refuse(options_.flags.seed.has_value(), "seed", &PipelineInfo::random);
    refuse(options_.view.depth.has_value(), "depth", &PipelineInfo::recursive);
    refuse(options_.view.classical_attenuation, "classical-attenuation", &PipelineInfo::recursive);
    refuse(options_.view.attenuation_length.has_value(), "attenuation-length", &PipelineInfo::local);
    if (options_.view.tessellation && used.solved)
      throw UsageError(
          fmt::format("--tessellation has no effect with --pipeline {}: a solve takes shapes at the chord "
                      "error of the scene file",
                      used.name));
  }

  // Of false colours there are no pipelines, and their values have no colours.
  void explain_false_colour_settings() const {
    const CLI::App& command = *app_.get_subcommand("view");
    if (options_.view.false_colour.empty()) return;
    for (const char* name : {"--pipeline", "--exposure", "--time-limit"})
      if (command.get_option(name)->count() > 0)
        throw UsageError(fmt::format("{} has no effect with --false-colour", name));
    if (options_.output.extension() == ".png") return;
    for (const char* name : {"--scale", "--range", "--isolines"})
      if (command.get_option(name)->count() > 0)
        throw UsageError(fmt::format("{} has no effect on {}, which holds the values; it belongs to .png",
                                     name, options_.output.extension().string()));
  }

  Options& options_;
  CLI::App app_{"Diffuse global illumination of closed and open scenes by the radiosity method.",
                "radiosity"};
};

std::string command_line(int argc, char** argv) {
  std::string line = "radiosity";
  for (int i = 1; i < argc; ++i) line += " " + shell_quoted(argv[i]);
  return line;
}

}  // namespace

std::string shell_quoted(const std::string& argument) {
  const bool plain =
      !argument.empty() && argument.find_first_of(" \t\n'\"\\$&|;<>()*?[]#~`!{}") == std::string::npos;
  if (plain) return argument;
  std::string quoted = "'";
  for (const char c : argument) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& known) {
  const auto longer = std::find_if(known.begin(), known.end(), [&](const std::string& candidate) {
    return !word.empty() && candidate.starts_with(word);
  });
  const std::optional<std::string> meant = longer != known.end() ? *longer : nearest_name(word, known);
  return meant ? fmt::format("; did you mean '{}'?", *meant) : ".";
}

std::optional<Options> parse_command_line(int argc, char** argv) {
  Options options;
  options.command_line = command_line(argc, argv);
  Parser parser(options);
  if (!parser.parse(argc, argv)) return {};
  return options;
}

SceneSettings override_settings(const SceneSettings& scene, const SceneSettings& flags) {
  SceneSettings settings = scene;
  const auto override_with = [](auto& setting, const auto& flag) {
    if (flag) setting = flag;
  };
  override_with(settings.patches, flags.patches);
  override_with(settings.elements, flags.elements);
  override_with(settings.element_samples, flags.element_samples);
  override_with(settings.method, flags.method);
  override_with(settings.samples, flags.samples);
  override_with(settings.resolution, flags.resolution);
  override_with(settings.factor_tolerance, flags.factor_tolerance);
  override_with(settings.seed, flags.seed);
  override_with(settings.solver, flags.solver);
  override_with(settings.tolerance, flags.tolerance);
  override_with(settings.max_iterations, flags.max_iterations);
  override_with(settings.relaxation, flags.relaxation);
  override_with(settings.ambient, flags.ambient);
  return settings;
}

}  // namespace radiosity::app
