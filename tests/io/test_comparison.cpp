// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "files.hpp"
#include "radiosity/io/comparison.hpp"

namespace radiosity::test {
namespace {

using testing::HasSubstr;
using testing::Not;

/// What ends elements of HTML, and what the page puts in its places.
const std::string kAwkward = "</script><!-- <b> & \"c\" {{pictures}} {{trade.json}} ü.toml";
const std::string kEscaped =
    "&lt;/script>&lt;!-- &lt;b> &amp; &quot;c&quot; {{pictures}} {{trade.json}} ü.toml";

/// Two meshes, the finer one the user's; one run on the coarse mesh, three on the user's of which one was left out.
Comparison made_up() {
  Comparison all;
  all.mesh = room({0, 0, 0}, {1, 1, 1}, false);
  all.radiosity = BandArray::Constant(6, 1, 2);
  all.meshes = {{PatchSize{0.5}, 0.5, 3, 0.01, 0.001}, {PatchSize{0.25}, 0.25, 6, 0.02, 0.001}};
  all.own = 1;
  all.factors.method = "hemisphere";
  all.factors.settings.samples = 4096;
  all.factors.solves = 2;
  all.factors.patches = 6;
  all.factors.noise = 1e-3;
  all.finer = all.factors;
  all.finer->patches = 96;
  all.finer->patch_error = 0.002;
  all.finer->order = 1.25;
  const auto run = [&](std::size_t mesh, const char* method, FormFactorOptions settings, double seconds) {
    ComparedRun& out = all.runs.emplace_back();
    out.mesh = mesh;
    out.method = method;
    out.settings = settings;
    out.seconds = seconds;
    out.bytes = 1e6 * seconds;
    out.total = RelativeError{0.004 / seconds, 0.2};
    if (mesh == all.own) out.factors = RelativeError{0.0123, 0.1};
    return &out;
  };
  run(0, "hemisphere", {.samples = 64}, 0.25);
  ComparedRun* shown = run(1, "hemisphere", {.samples = 256}, 0.5);
  shown->standard = true;
  shown->traced = TracedError{0.013, 0.002, -0.001, 0.0005};
  shown->where = Eigen::ArrayXd::LinSpaced(6, 0, 0.01);
  run(1, "hemicube", {.samples = 4, .resolution = 32}, 0.75)->factors->rms = 1e-4;  // below the noise
  ComparedRun& missing = *run(1, "analytic", {.samples = 36}, 0);
  missing.standard = true;
  missing.total = missing.factors = std::nullopt;
  missing.left_out = "interrupted by " + kAwkward;
  all.tracing = ComparedTracing{4, 16, 32, 1.5, 0.011};
  all.finer->traced = TracedError{0.001, 0.002, 0.0004, 0.0003};
  all.where_patches = Eigen::ArrayXd::Constant(6, 0.02);
  all.solvers = {{"jacobi", 0.1, "", 7, 0.125, 0.09, 0.03}, {"jacobi", 0.01, "no time"}};
  all.notes = {"a note of " + kAwkward};
  all.completed = false;
  return all;
}

class ComparisonFiles : public testing::Test {
 protected:
  explicit ComparisonFiles(const Comparison& comparison = made_up()) {
    write_comparison(folder_ / "out", comparison,
                     {"1.2.3", "radiosity compare " + kAwkward, kAwkward, {}, 0});
  }
  std::string read(const std::string& file) const { return read_text(folder_ / ("out/" + file)); }

  /// What lies in the page between <script … id="…"> and </script>.
  std::string block(const std::string& id) const {
    const std::string page = read("index.html"),
                      start = "<script type=\"application/json\" id=\"" + id + "\">";
    const std::size_t from = page.find(start) + start.size();
    return page.substr(from, page.find("</script>", from) - from);
  }

  TemporaryDirectory folder_;
};

TEST_F(ComparisonFiles, ThePageHoldsTradeJsonBitForBit) {
  EXPECT_EQ(block("trade"), read("trade.json"));
  const nlohmann::json trade = nlohmann::json::parse(read("trade.json"));
  EXPECT_EQ(trade["scene"], kAwkward);
  EXPECT_EQ(trade["bands"], 1);
  EXPECT_EQ(trade["runs"][1]["standard"], true);
  // The slowest and largest run errs least.
  EXPECT_EQ(trade["runs"][2]["pareto"], true);
  EXPECT_EQ(trade["runs"][2]["pareto_bytes"], true);
}

TEST_F(ComparisonFiles, ThePageHoldsAPictureOfTheSceneAndOnePerMap) {
  const nlohmann::json pictures = nlohmann::json::parse(block("pictures"));
  const std::string png = "data:image/png;base64,iVBORw0KGgo";  // the signature of PNG
  EXPECT_EQ(pictures["scene"].get<std::string>().substr(0, png.size()), png);
  ASSERT_EQ(pictures["maps"].size(), 2U);
  for (const nlohmann::json& map : pictures["maps"])
    EXPECT_EQ(map["picture"].get<std::string>().substr(0, png.size()), png);
  EXPECT_EQ(pictures["maps"][0]["run"], 1);
  EXPECT_EQ(pictures["maps"][1]["run"], nullptr);
  EXPECT_EQ(pictures["most"], 0.1);  // the decade above 2 %
}

TEST_F(ComparisonFiles, ThePageFetchesNothingAndHasASentenceForThoseWithoutJavaScript) {
  const std::string page = read("index.html");
  EXPECT_THAT(page, HasSubstr("content=\"default-src 'none'; img-src data:;"));  // the browser sees to it
  EXPECT_THAT(page, HasSubstr("<a href=\"trade.csv\">"));
  EXPECT_THAT(page, HasSubstr("</noscript>"));
}

TEST_F(ComparisonFiles, TheScriptDrawsAllThatWasMeasured) {
  if (std::system("node --version > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "there is no node to run the script";
  const std::string drawn = folder_ / "drawn.html";
  ASSERT_EQ(std::system(("node '" RADIOSITY_SOURCE_DIR "/tests/io/draw_page.mjs' '" +
                         (folder_ / "out/index.html").string() + "' > '" + drawn + "'")
                            .c_str()),
            0);
  std::string page = read_text(drawn);
  const std::string hard_space = "\u00a0";
  for (auto at = page.find(hard_space); at != std::string::npos; at = page.find(hard_space))
    page.replace(at, hard_space.size(), " ");
  for (const std::string& part :
       {"Speed against accuracy: " + kAwkward + "\n",  // the title is text
        "<h1>Speed against accuracy: " + kEscaped, "Note: a note of " + kEscaped,
        "interrupted by " + kEscaped, std::string("which was interrupted"),
        std::string("<span>OUT.vtp</span>"),
        // 5 %: 0.4 / 0.25 % and, of the reference, √(0.1² + 0.2²) %
        std::string("takes 0.25 s and errs by at most 1.8 % (measured: 1.6 %)"),
        std::string(": not reached by anything that was tried"),
        std::string("hemisphere 256, 6 patches: 0.5 s, 0.5 MB, 1.2 %"), std::string("hemicube, 4 viewpoints"),
        std::string("below what the reference can tell"), std::string("hemisphere 256 (default): 1.2 % rms"),
        std::string("what the size of the patches does"), std::string("<span>≤ 0.01 %</span>"),
        std::string("<span>10 % and more</span>"),
        std::string("Default settings that did not run on these patches: analytic (interrupted"),
        std::string("(96 patches): the error falls as (size)<sup>1.3</sup>"),
        std::string("jacobi: 7 products, 0.13 s, error 3 %"), std::string("1e-2"), std::string("no time"),
        std::string(
            "its patches by about 0.2 %. Path tracing says: by 0.1 ± 0.2 %, 0.04 ± 0.03 % in the mean."),
        std::string("4 of the patches, 512 paths each, 1.5 s"), std::string("1.3 ± 0.2 %"),
        std::string("1 run was left out"), std::string("4 × 32"), std::string("radiosity 1.2.3")})
    EXPECT_THAT(page, HasSubstr(part));
  for (const char* wrong : {"NaN", "undefined", "null", "Infinity"}) EXPECT_THAT(page, Not(HasSubstr(wrong)));
}

}  // namespace
}  // namespace radiosity::test
