// SPDX-License-Identifier: GPL-3.0-or-later
#include "comparison_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <vtkBase64Utilities.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "gnuplot.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/png.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {
namespace {

using Rgb = Rgb8;

/// Colours that the colour-blind can tell apart [Okabe and Ito].
constexpr std::array<const char*, 7> kColours{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                              "#E69F00", "#56B4E9", "#555555"};
/// Ten colours of the map "viridis", at even distances; between them linear.
constexpr std::array<Rgb, 10> kViridis{{{68, 1, 84},
                                        {72, 40, 120},
                                        {62, 74, 137},
                                        {49, 104, 142},
                                        {38, 130, 142},
                                        {31, 158, 137},
                                        {53, 183, 121},
                                        {109, 205, 89},
                                        {180, 222, 44},
                                        {253, 231, 37}}};

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

// A command breaks between words only, not at their hyphens.
std::string words(const std::string& command) {
  std::string out = "<span>";
  for (const char c : command) out += c == ' ' ? std::string("</span> <span>") : escaped({&c, 1});
  return out + "</span>";
}

std::string percent(double share) {
  return fmt::format("{:.2g} %", 100 * share);
}
std::string megabytes(double bytes) {
  return fmt::format("{:.3g} MB", bytes / 1e6);
}
std::string settings_text(const FormFactorOptions& settings) {
  return settings.resolution > 0 ? fmt::format("{} × {}", settings.samples, settings.resolution)
                                 : fmt::format("{}", settings.samples);
}

// A set of points with one look, in gnuplot's words.
struct Series {
  std::string title;  ///< empty: not in the legend
  std::string look;   ///< "with …"
  struct Point {
    double x, y;
    std::string label = {};
  };
  std::vector<Point> points;
};

struct Diagram {
  std::string x_label, y_label;
  std::vector<Series> series;
};

/// Both axes logarithmic, with some room round the data. Points with labels get them written beside them.
std::string svg(const Diagram& diagram) {
  std::string script =
      "set terminal svg size 860,440 dynamic font 'sans-serif,13' background 'white'\n"
      "set encoding utf8\nset logscale xy\nset border 3 lc rgb "
      "'#444444'\n"
      "set tics nomirror\nset format xy '%g'\nset grid mxtics mytics xtics ytics lt 1 lc rgb '#bbbbbb', lt 1 "
      "lc rgb '#eeeeee'\n";
  double left = HUGE_VAL, right = 0, low = HUGE_VAL, high = 0;
  for (const Series& series : diagram.series)
    for (const auto& point : series.points) {
      left = std::min(left, point.x);
      right = std::max(right, point.x);
      low = std::min(low, point.y);
      high = std::max(high, point.y);
    }
  constexpr double kRoom = 1.4;
  // Less than two decades may hold one power of ten only: there 2 and 5 are written, too.
  const auto ticks = [](char axis, double from, double to) {
    if (to > 100 * from) return std::string();
    std::vector<std::string> marks;
    for (int d = static_cast<int>(std::floor(std::log10(from))); std::pow(10.0, d) <= to; ++d)
      for (const int m : {1, 2, 5}) marks.push_back(fmt::format("{:g}", m * std::pow(10.0, d)));
    return fmt::format("set {}tics ({})\n", axis, fmt::join(marks, ", "));
  };
  left /= kRoom, right *= kRoom, low /= kRoom, high *= kRoom;
  script += fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\n{}{}", left, right, low, high,
                        ticks('x', left, right), ticks('y', low, high));
  script += fmt::format("set xlabel '{}'\nset ylabel '{}'\nset key outside right top reverse Left\n",
                        diagram.x_label, diagram.y_label);
  std::vector<std::string> plots;
  for (std::size_t s = 0; s < diagram.series.size(); ++s) {
    const Series& series = diagram.series[s];
    script += fmt::format("$d{} << EOD\n", s);
    bool labels = false;
    for (const auto& [x, y, label] : series.points) {
      script += fmt::format("{} {} \"{}\"\n", x, y, label);
      labels = labels || !label.empty();
    }
    if (series.points.empty()) script += "NaN NaN \"\"\n";
    script += "EOD\n";
    plots.push_back(fmt::format("$d{} using 1:2 {} {}", s, series.look,
                                series.title.empty() ? "notitle" : fmt::format("title '{}'", series.title)));
    if (labels)
      plots.push_back(
          fmt::format("$d{} using 1:2:3 with labels font ',10' tc rgb '#444444' offset 0,0.8 notitle", s));
  }
  script += fmt::format("plot {}\n", fmt::join(plots, ", \\\n  "));
  std::string drawn = gnuplot(script);
  // Inside of HTML the prologue and the names of the name spaces have no place.
  drawn.erase(0, drawn.find("<svg"));
  if (drawn.empty()) throw IoError("gnuplot drew nothing");
  for (const char* space :
       {"xmlns=\"http://www.w3.org/2000/svg\"", "xmlns:xlink=\"http://www.w3.org/1999/xlink\""})
    if (const auto at = drawn.find(space); at != std::string::npos)
      drawn.erase(at, std::string_view(space).size());
  return "<div class=\"wide\">" + drawn + "</div>";
}

std::string png(const Image& image) {
  const std::string bytes = encode_png(image);
  std::string text((bytes.size() + 2) / 3 * 4 + 4, '\0');
  const auto length = vtkBase64Utilities::Encode(reinterpret_cast<const unsigned char*>(bytes.data()),
                                                 bytes.size(), reinterpret_cast<unsigned char*>(text.data()));
  text.resize(length);
  return "data:image/png;base64," + text;
}

class Page {
 public:
  Page(const Comparison& comparison, const ComparisonOrigin& origin) : all_(comparison), origin_(origin) {
    for (const ComparedRun& run : all_.runs)
      if (std::find(methods_.begin(), methods_.end(), run.method) == methods_.end())
        methods_.push_back(run.method);
  }

  std::string text() {
    html_ += R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Speed against accuracy: )" +
             escaped(origin_.scene) + R"(</title>
<style>
body { font: 16px/1.5 sans-serif; color: #222; max-width: 62em; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; } h2 { font-size: 1.25em; margin-top: 2em; border-bottom: 1px solid #ccc; }
code, pre { font-family: monospace; font-size: 0.92em; } code span, pre span { white-space: nowrap; } pre { background: #f4f4f4; padding: 0.6em; white-space: pre-wrap; margin: 0.2em 0 0.8em; }
table { border-collapse: collapse; font-size: 0.88em; } th, td { padding: 0.15em 0.7em; text-align: right; border-bottom: 1px solid #e4e4e4; }
th { border-bottom: 1px solid #888; vertical-align: bottom; } td.l, th.l { text-align: left; } tr.best { background: #eef6ea; }
.wide { overflow-x: auto; } td, th { white-space: nowrap; } td.l { white-space: normal; min-width: 6em; }
svg { display: block; width: 100%; min-width: 40em; height: auto; } .note { color: #555; font-size: 0.9em; }
.maps { display: grid; grid-template-columns: repeat(auto-fill, minmax(17em, 1fr)); gap: 1em; } figure { margin: 0; }
figure img { width: 100%; border: 1px solid #ccc; } figcaption { font-size: 0.88em; }
.scale { height: 1em; border: 1px solid #888; } .ticks { display: flex; justify-content: space-between; font-size: 0.85em; }
details { margin-top: 0.6em; }
</style></head><body>
)";
    add("<h1>Speed against accuracy: {}</h1>\n", escaped(origin_.scene));
    const ComparedMesh& own = all_.meshes[all_.own];
    add("<p>{} patches, no edge longer than {:.3g} m, {} {}. All that follows was measured on this machine "
        "in {:.3g} s, by "
        "<code>{}</code>{}.</p>\n",
        own.patches, own.size, all_.radiosity.cols(), all_.radiosity.cols() == 1 ? "band" : "bands",
        all_.seconds, words(origin_.command),
        all_.completed ? "" : ", which was interrupted: what is missing had not been measured");
    add_advice();
    add_totals();
    add_factors();
    add_maps();
    add_patches();
    add_solvers();
    add_references();
    add_tables();
    add("<p class=\"note\">radiosity {}</p>\n</body></html>\n", escaped(origin_.version));
    return std::move(html_);
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    html_ += fmt::format(format, std::forward<Args>(args)...);
  }

  std::string colour(const std::string& method) const {
    const auto place = std::find(methods_.begin(), methods_.end(), method) - methods_.begin();
    return kColours[static_cast<std::size_t>(place) % kColours.size()];
  }

  void add_advice() {
    add("<h2>What to do</h2>\n");
    const bool total = all_.finer.has_value();
    for (const Advice& line : advice(all_)) {
      if (!line.run) {
        add("<p><b>{:g} %</b>: not reached by anything that was tried; a larger <code>--budget</code> or "
            "smaller patches may.</p>\n",
            100 * line.error);
        continue;
      }
      const ComparedRun& run = all_.runs[*line.run];
      add("<p><b>{:g} %</b>: takes {:.2g} s and errs by at most {} (measured: {}).</p>\n<pre>{}</pre>\n",
          100 * line.error, run.seconds, percent(*error_at_most(all_, run)),
          percent(total ? run.total->rms : run.factors->rms), words(solve_command(all_, run, origin_)));
    }
    add("<p class=\"note\">The error is that of the radiosities B of all patches, √(Σ A ΔB² / Σ A (B − E)²): "
        "the root mean square, "
        "weighted with area, relative to the light that is reflected. {} “At most” adds what the reference "
        "itself may err by. "
        "Seconds are those of patches, form factors and solution; reading and writing come on top.</p>\n",
        total ? "It holds what form factors and the size of the patches do to the mean of each patch; how B "
                "varies inside of a patch is not in it, so pictures and shadow edges may need smaller ones."
              : "It is that of the form factors alone: no finer mesh could be afforded, so what the size of "
                "the patches does is "
                "not in it.");
    for (const std::string& note : all_.notes) add("<p class=\"note\">Note: {}.</p>\n", escaped(note));
  }

  Series front(const std::vector<CostAndError>& points, double scale) const {
    Series out{"no other is both cheaper and better", "with lines lw 1.5 lc rgb '#000000' dt 2", {}};
    for (const std::size_t k : pareto_front(points))
      out.points.push_back({points[k].cost * scale, 100 * points[k].error});
    return out;
  }

  Diagram cloud(const std::string& x_label, const std::vector<std::size_t>& index,
                const std::vector<CostAndError>& points, double scale) const {
    constexpr std::array kShapes{5, 7, 9, 13, 11};  // filled: square, circle, triangle, diamond, triangle
    Diagram out{x_label, "error at most, %", {}};
    for (const std::string& method : methods_)
      for (std::size_t m = 0; m < all_.meshes.size(); ++m) {
        Series series{
            fmt::format("{}, {} patches", method, all_.meshes[m].patches),
            fmt::format("with points pt {} ps 0.9 lc rgb '{}'", kShapes[m % kShapes.size()], colour(method)),
            {}};
        for (std::size_t k = 0; k < points.size(); ++k) {
          const ComparedRun& run = all_.runs[index[k]];
          if (run.method == method && run.mesh == m)
            series.points.push_back({points[k].cost * scale, 100 * points[k].error});
        }
        if (!series.points.empty()) out.series.push_back(std::move(series));
      }
    out.series.push_back(front(points, scale));
    return out;
  }

  void add_totals() {
    const Measured all = measured(all_);
    if (all.index.empty()) return;
    add("<h2>Seconds and memory against error</h2>\n");
    add("<p>Each point is a method at one setting on one mesh. Further left is faster, further down is "
        "better; the dashed line "
        "joins those that no other beats in both.</p>\n{}\n{}\n",
        svg(cloud("seconds", all.index, all.by_seconds, 1)),
        svg(cloud("memory of the form factors, MB", all.index, all.by_bytes, 1e-6)));
  }

  void add_factors() {
    // A line for each method and, where it has cells, for each number of viewpoints.
    std::map<std::pair<std::string, Index>, Series> lines;
    Series below{"below what the reference can tell", "with points pt 10 ps 1.1 lw 1.5 lc rgb '#000000'", {}};
    double first = HUGE_VAL, last = 0;
    const double noise = std::max(all_.factors.noise, 1e-9);
    for (const ComparedRun& run : all_.runs) {
      if (!run.factors) continue;
      const bool cells = run.settings.resolution > 0;
      Series& line = lines[{run.method, cells ? run.settings.samples : 0}];
      line.title = cells ? fmt::format("{}, {} viewpoint{}", run.method, run.settings.samples,
                                       run.settings.samples == 1 ? "" : "s")
                         : run.method;
      const double error = std::max(run.factors->rms, noise);
      line.points.push_back({run.seconds, 100 * error,
                             fmt::format("{}", cells ? run.settings.resolution : run.settings.samples)});
      if (run.factors->rms < noise) below.points.push_back({run.seconds, 100 * error});
      first = std::min(first, run.seconds);
      last = std::max(last, run.seconds);
    }
    if (lines.empty()) return;
    Diagram diagram{"seconds", "error of B from the form factors, %", {}};
    std::size_t k = 0;
    for (auto& [key, line] : lines) {
      line.look =
          fmt::format("with linespoints lw 2 pt 7 ps 0.7 lc rgb '{}'", kColours[k++ % kColours.size()]);
      diagram.series.push_back(line);
    }
    diagram.series.push_back({"the reference itself",
                              "with lines lw 1.5 dt 3 lc rgb '#000000'",
                              {{first, 100 * noise}, {last, 100 * noise}}});
    if (!below.points.empty()) diagram.series.push_back(below);
    add("<h2>Work and precision of the methods</h2>\n<p>On {} patches, against the same patches with better "
        "form factors: what the "
        "choice of method and its setting (beside the points: rays, points, or cells along an edge) does by "
        "itself.</p>\n{}\n",
        all_.meshes[all_.own].patches, svg(diagram));
  }

  void add_maps() {
    struct Map {
      std::string caption;
      const Eigen::ArrayXd* values;
    };
    std::vector<Map> maps;
    for (const ComparedRun& run : all_.runs)
      if (run.where.size() > 0)
        maps.push_back({fmt::format("{} {}{}: {} rms", run.method, settings_text(run.settings),
                                    run.standard ? " (default)" : ", in place of its default",
                                    percent(run.factors->rms)),
                        &run.where});
    if (all_.where_patches.size() > 0)
      maps.push_back({"what the size of the patches does, with the best form factors", &all_.where_patches});
    if (maps.empty()) return;
    // From the decade that the hundredth part of all area exceeds, three decades down.
    std::vector<double> values;
    for (const Map& map : maps) values.insert(values.end(), map.values->begin(), map.values->end());
    const auto quantile =
        values.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), quantile, values.end());
    constexpr int kDecades = 3;
    const int top = *quantile > 0 ? static_cast<int>(std::ceil(std::log10(*quantile))) : 0;
    const PatchMesh& mesh = *all_.mesh;
    const Visibility visibility(mesh);
    const Camera camera = origin_.camera ? *origin_.camera : automatic_camera(mesh);
    constexpr int kWidth = 480, kHeight = 400, kSamples = 2;
    add("<h2>Where the methods are wrong</h2>\n<div class=\"maps\">\n");
    const double exposure = automatic_exposure(mesh, all_.radiosity);
    add("<figure><img alt=\"the scene\" src=\"{}\"><figcaption>the reference</figcaption></figure>\n",
        png(render(visibility, vertex_values(mesh, all_.radiosity), camera, kWidth, kHeight, exposure,
                   kSamples)));
    for (const Map& map : maps) {
      std::vector<Rgb> colours;
      for (const double value : *map.values)
        colours.push_back(colour_of(value > 0 ? 1 + (std::log10(value) - top) / kDecades : 0));
      add("<figure><img alt=\"error map\" src=\"{}\"><figcaption>{}</figcaption></figure>\n",
          png(paint(visibility, colours, camera, kWidth, kHeight, kSamples)), escaped(map.caption));
    }
    std::vector<std::string> missing;
    for (const ComparedRun& run : all_.runs)
      if (run.standard && run.mesh == all_.own && !run.left_out.empty())
        missing.push_back(fmt::format("{} ({})", run.method, escaped(run.left_out)));
    std::vector<std::string> stops, ticks;
    for (const Rgb& c : kViridis) stops.push_back(fmt::format("rgb({} {} {})", c[0], c[1], c[2]));
    for (int d = 0; d <= kDecades; ++d)
      ticks.push_back(fmt::format("<span>{}{:g} %{}</span>", d == 0 ? "≤ " : "",
                                  100 * std::pow(10.0, top - kDecades + d),
                                  d == kDecades ? " and more" : ""));
    add("</div>\n<p>|ΔB| over the mean of the reflected light:</p>\n<div class=\"scale\" style=\"background: "
        "linear-gradient(to right, "
        "{})\"></div>\n<div class=\"ticks\">{}</div>\n",
        fmt::join(stops, ", "), fmt::join(ticks, ""));
    if (!missing.empty())
      add("<p class=\"note\">Default settings that did not run on these patches: {}.</p>\n",
          fmt::join(missing, "; "));
  }

  static Rgb colour_of(double t) {
    const double place = std::clamp(t, 0.0, 1.0) * (kViridis.size() - 1);
    const auto k = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
    const double f = place - static_cast<double>(k);
    Rgb out{};
    for (std::size_t c = 0; c < 3; ++c)
      out[c] = static_cast<std::uint8_t>(std::lround((1 - f) * kViridis[k][c] + f * kViridis[k + 1][c]));
    return out;
  }

  void add_patches() {
    if (!all_.finer) return;
    Diagram diagram{"longest edge of a patch, m", "error of B, %", {}};
    for (const std::string& method : methods_) {
      Series line{fmt::format("{}, its best setting", method),
                  fmt::format("with linespoints lw 2 pt 7 ps 0.8 lc rgb '{}'", colour(method)),
                  {}};
      for (std::size_t m = 0; m < all_.meshes.size(); ++m) {
        double best = HUGE_VAL;
        for (const ComparedRun& run : all_.runs)
          if (run.mesh == m && run.method == method && run.total) best = std::min(best, run.total->rms);
        if (best < HUGE_VAL) line.points.push_back({all_.meshes[m].size, 100 * std::max(best, 1e-9)});
      }
      if (!line.points.empty()) diagram.series.push_back(std::move(line));
    }
    if (diagram.series.empty()) return;
    const double noise = 100 * std::max(all_.finer->own_error(), 1e-9);
    diagram.series.push_back({"the reference itself, at most",
                              "with lines lw 1.5 dt 3 lc rgb '#000000'",
                              {{all_.meshes.front().size, noise}, {all_.meshes.back().size, noise}}});
    add("<h2>What smaller patches gain</h2>\n<p>Against the finer reference ({} patches): the error falls as "
        "(size)<sup>{:.2g}</sup>{}."
        "</p>\n{}\n",
        all_.finer->patches, all_.finer->order.value_or(1),
        all_.finer->order_assumed
            ? ", the least that is expected: coarser meshes do not tell, or noise hides it"
            : ", measured by three meshes",
        svg(diagram));
  }

  void add_solvers() {
    std::map<std::string, Series> lines;
    std::vector<std::string> order;
    for (const SolverRun& run : all_.solvers) {
      if (!(run.seconds > 0) || !(run.residual > 0) || !(run.products > 0)) continue;
      auto& line = lines[run.solver];
      if (line.title.empty()) {
        order.push_back(run.solver);
        line.title = run.solver;
        line.look = fmt::format("with linespoints lw 2 pt 7 ps 0.7 lc rgb '{}'",
                                kColours[(order.size() - 1) % kColours.size()]);
      }
      line.points.push_back({run.products, run.residual});
    }
    if (lines.empty()) return;
    Diagram diagram{"products by the matrix of form factors (a shot is one row of it)",
                    "residual, share of the power",
                    {}};
    for (const std::string& name : order) diagram.series.push_back(lines[name]);
    add("<h2>Solvers</h2>\n<p>All on one and the same matrix of {} patches, to tolerances from 0.1 to 1e-8. "
        "Where shooting "
        "(progressive) needs less than one product, it needs fewer rows of the matrix than there are, and "
        "none is "
        "stored.</p>\n{}\n<details><summary>Table</summary>\n<div class=\"wide\"><table><tr><th "
        "class=\"l\">solver</th><th>tolerance</th><th>products</th>"
        "<th>seconds</th><th>residual</th><th>error of B</th><th class=\"l\">left out</th></tr>\n",
        all_.meshes[all_.own].patches, svg(diagram));
    for (const SolverRun& run : all_.solvers) {
      add("<tr><td class=\"l\">{}</td><td>{:.0e}</td>", run.solver, run.tolerance);
      if (run.seconds > 0)
        add("<td>{:.3g}</td><td>{:.2g}</td><td>{:.1e}</td><td>{}</td>", run.products, run.seconds,
            run.residual, percent(run.error));
      else
        add("<td></td><td></td><td></td><td></td>");
      add("<td class=\"l\">{}</td></tr>\n", escaped(run.left_out));
    }
    add("</table></div></details>\n");
  }

  void add_reference(const ComparedReference& reference, const char* what) {
    add("<li>{}: {} patches, {} with {} {}{}, {:.2g} s. Its form factors err by {}{}.</li>\n", what,
        reference.patches, reference.method, reference.settings.samples,
        reference.solves == 2 ? "rays from each" : "points in partial shadow",
        reference.solves == 2 ? ", the mean of two solutions with seeds of their own" : "", reference.seconds,
        percent(reference.noise),
        reference.patch_error ? fmt::format(", its patches by about {}", percent(*reference.patch_error))
                              : "");
  }

  void add_references() {
    add("<h2>What it was held against</h2>\n<ul>\n");
    add_reference(all_.factors, "The same patches");
    if (all_.finer) add_reference(*all_.finer, "Finer patches, averaged over the coarser ones");
    add("</ul>\n<p class=\"note\">Errors smaller than the reference’s own cannot be told from it. No rung "
        "has more than a tenth of its "
        "rays or points.</p>\n");
  }

  void add_tables() {
    const std::vector<std::size_t> best = front_runs(all_);
    add("<h2>All runs</h2>\n<p>“Largest” is the largest error of a patch that reflects 1 % of the mean or "
        "more, relative to what it "
        "reflects. Green rows: no other is both faster and better.</p>\n<div class=\"wide\"><table><tr><th "
        "class=\"l\">method</th><th>setting</th>"
        "<th>patches</th><th>seconds</th><th>memory</th><th>error of<br>factors</th><th>error,<br>all "
        "told</th><th>largest</th>"
        "<th>at most</th></tr>\n");
    for (std::size_t r = 0; r < all_.runs.size(); ++r) {
      const ComparedRun& run = all_.runs[r];
      if (!run.left_out.empty()) continue;
      add("<tr{}><td "
          "class=\"l\">{}</td><td>{}</td><td>{}</td><td>{:.2g}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</"
          "td><td>{}</"
          "td></tr>\n",
          std::find(best.begin(), best.end(), r) != best.end() ? " class=\"best\"" : "", run.method,
          settings_text(run.settings), all_.meshes[run.mesh].patches, run.seconds, megabytes(run.bytes),
          run.factors ? percent(run.factors->rms) : "", run.total ? percent(run.total->rms) : "",
          run.total     ? percent(run.total->largest)
          : run.factors ? percent(run.factors->largest)
                        : "",
          percent(error_at_most(all_, run).value_or(0)));
    }
    add("</table></div>\n");
    const auto left = std::count_if(all_.runs.begin(), all_.runs.end(),
                                    [](const ComparedRun& run) { return !run.left_out.empty(); });
    if (left == 0) return;
    add("<details><summary>{} runs were left out</summary>\n<div class=\"wide\"><table><tr><th "
        "class=\"l\">method</th><th>setting</th><th>patches</th><th "
        "class=\"l\">why</th></tr>\n",
        left);
    for (const ComparedRun& run : all_.runs)
      if (!run.left_out.empty())
        add("<tr><td class=\"l\">{}</td><td>{}</td><td>{}</td><td class=\"l\">{}</td></tr>\n", run.method,
            settings_text(run.settings), all_.meshes[run.mesh].patches, escaped(run.left_out));
    add("</table></div></details>\n");
  }

  const Comparison& all_;
  const ComparisonOrigin& origin_;
  std::vector<std::string> methods_;
  std::string html_;
};

}  // namespace

std::string comparison_page(const Comparison& comparison, const ComparisonOrigin& origin) {
  return Page(comparison, origin).text();
}

}  // namespace radiosity
