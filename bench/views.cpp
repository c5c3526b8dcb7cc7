// SPDX-License-Identifier: GPL-3.0-or-later
// What each pipeline costs and how far its pictures are from what the materials say: the tables of docs/views.md.
#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "radiosity/rendering/pipeline.hpp"
#include "radiosity/rendering/render.hpp"
#include "radiosity/rendering/tone_map.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace {

using namespace radiosity;

struct BenchScene {
  std::string name;
  Scene scene;
  std::vector<Light> lights;
  Camera camera;
  double patch_size;  ///< m, of the solution that is shown
};

BenchScene from_file(const std::string& name, const std::filesystem::path& file, double patch_size) {
  LoadedScene loaded = read_scene(file);
  const Camera camera = loaded.settings.camera
                            ? *loaded.settings.camera
                            : automatic_camera(make_patches(loaded.scene, KeepFaces{}).mesh);
  // As a solve does: solution and lights have the same bands.
  Scene scene = loaded.lights.empty() ? merge_equal_bands(loaded.scene) : std::move(loaded.scene);
  return {name, std::move(scene), std::move(loaded.lights), camera, patch_size};
}

BenchScene office() {
  Camera camera;
  camera.position = {3.2, 4.7, 1.8};
  camera.target = {1, 0.8, 0.8};
  camera.up = {0, 0, 1};
  camera.vertical_fov_deg = 65;
  return {"office of 4 rooms", test::office_building(4), {}, camera, 0.3};
}

struct Cost {
  double wall, cpu;  ///< s
};
Cost cost_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
}

/// Linux: megabytes that were resident at most since the last call, above what was then.
class Memory {
 public:
  void begin() {
    malloc_trim(0);  // what earlier work has freed must not hide what this one takes
    std::ofstream("/proc/self/clear_refs") << 5;
    before_ = megabytes("VmRSS:");
  }
  double most() const { return megabytes("VmHWM:") - before_; }

 private:
  static double megabytes(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with(name)) return std::stod(line.substr(name.size())) / 1e3;
    return 0;
  }
  double before_ = 0;
};

/// How far a picture is from the reference where that is darker than a display's white, all its noise included: rms of the difference
/// less the reference's noise, 1 is white.
class Judge {
 public:
  Judge(const LinearImage& reference, double exposure)
      : exposure_(exposure),
        truth_(exposure * reference.radiosity),
        noise_(exposure * *reference.standard_error) {
    counts_ = (truth_ + 3 * noise_ < 1.0).cast<double>();
  }
  double difference(const LinearImage& image) const {
    const BandArray error = (exposure_ * image.radiosity).min(1.0) - truth_;
    const double square = (counts_ * (error.square() - noise_.square())).sum() / counts_.sum();
    return std::sqrt(std::max(0.0, square));
  }
  double noise() const { return std::sqrt((counts_ * noise_.square()).sum() / counts_.sum()); }

 private:
  double exposure_;
  BandArray truth_, noise_, counts_;  // counts_: 1 where a value does
};

/// Fastest of nine of both, in turn, s.
std::pair<double, double> fastest(const std::function<void()>& one, const std::function<void()>& other) {
  std::pair best{HUGE_VAL, HUGE_VAL};
  for (int k = 0; k < 9; ++k) {
    best.first = std::min(best.first, cost_of(one).cpu);
    best.second = std::min(best.second, cost_of(other).cpu);
  }
  return best;
}

// In the robust mode of Visibility: what differs is then the toolkit alone.
class RawEmbree {
 public:
  RawEmbree(const Visibility& visibility, const PatchMesh& faces)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const x = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                static_cast<std::size_t>(faces.vertex_count())));
    for (Index v = 0; v < faces.vertex_count(); ++v) {
      const Vec3 p = visibility.scaled(faces.vertex(v));
      for (int k = 0; k < 3; ++k) x[3 * v + k] = static_cast<float>(p[k]);
    }
    auto* const corners =
        static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                       3 * sizeof(unsigned), faces.triangles().size()));
    for (std::size_t t = 0; t < faces.triangles().size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) corners[3 * t + k] = static_cast<unsigned>(faces.triangles()[t][k]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_);
  }
  ~RawEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  RawEmbree(const RawEmbree&) = delete;
  RawEmbree& operator=(const RawEmbree&) = delete;

  // As many rays at once as the processor has vectors for.
  Index packet(const Visibility::Packet& from) const {
    if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0)
      return packet<RTCRayHit16, 16>(from, rtcIntersect16);
    return packet<RTCRayHit8, 8>(from, rtcIntersect8);
  }

  bool single(const Vec3& from, const Vec3& d) const {
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(from.x());
    ray.ray.org_y = static_cast<float>(from.y());
    ray.ray.org_z = static_cast<float>(from.z());
    ray.ray.dir_x = static_cast<float>(d.x());
    ray.ray.dir_y = static_cast<float>(d.y());
    ray.ray.dir_z = static_cast<float>(d.z());
    ray.ray.tfar = HUGE_VALF;
    ray.ray.mask = ~0U;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &ray);
    return ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }

 private:
  template <class Rays, std::size_t kLanes, class Trace>
  Index packet(const Visibility::Packet& from, Trace trace) const {
    Index hits = 0;
    for (std::size_t first = 0; first < static_cast<std::size_t>(from.count); first += kLanes) {
      Rays rays{};
      alignas(64) int valid[kLanes];
      for (std::size_t k = 0; k < kLanes; ++k) {
        const std::size_t i = first + k;
        valid[k] = static_cast<int>(i) < from.count ? -1 : 0;
        rays.ray.org_x[k] = from.x[i];
        rays.ray.org_y[k] = from.y[i];
        rays.ray.org_z[k] = from.z[i];
        rays.ray.dir_x[k] = from.dx[i];
        rays.ray.dir_y[k] = from.dy[i];
        rays.ray.dir_z[k] = from.dz[i];
        rays.ray.tnear[k] = 0;
        rays.ray.tfar[k] = HUGE_VALF;
        rays.ray.mask[k] = ~0U;
        rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      }
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
      trace(valid, scene_, &context, &rays);
      for (std::size_t k = 0; k < kLanes; ++k)
        hits += valid[k] != 0 && rays.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
    return hits;
  }

  RTCDevice device_;
  RTCScene scene_;
};

std::vector<Visibility::Packet> packets_of_pixels(const Visibility& visibility, const Pinhole& eye, int width,
                                                  int height) {
  const Vec3 from = visibility.scaled(eye.position());
  std::vector<Visibility::Packet> packets;
  for (int y = 0; y < height; ++y)
    for (int first = 0; first < width; first += 16) {
      Visibility::Packet& packet = packets.emplace_back();
      packet.from = Visibility::kNothing;
      packet.count = std::min(16, width - first);
      packet.x.fill(static_cast<float>(from.x()));
      packet.y.fill(static_cast<float>(from.y()));
      packet.z.fill(static_cast<float>(from.z()));
      for (int k = 0; k < packet.count; ++k) {
        const Vec3 d = eye.direction((first + k + 0.5) / width, (y + 0.5) / height);
        const auto i = static_cast<std::size_t>(k);
        packet.dx[i] = static_cast<float>(d.x());
        packet.dy[i] = static_cast<float>(d.y());
        packet.dz[i] = static_cast<float>(d.z());
      }
    }
  return packets;
}

/// Like those of `hemisphere` with 4,096 rays: from points all over a patch into a 4 × 4 block of cosine-distributed directions.
std::vector<Visibility::Packet> packets_of_patches(const Visibility& visibility, int count) {
  constexpr int kBlocks = 16, kOfPatch = 64;
  const PatchMesh& mesh = visibility.mesh();
  RandomStream random(5, 0);
  std::vector<Visibility::Packet> packets;
  const int patches = std::max(1, count / kOfPatch);
  for (int p = 0; p < patches; ++p) {
    const Index patch = one_of_stretch(p, patches, mesh.patch_count());
    if (visibility.covered(patch)) continue;
    const PatchSampler points(mesh, patch);
    Vec3 t, b;
    tangents(mesh.normal(patch), t, b);
    const Sample2 shift{random.uniform(), random.uniform()};
    for (std::uint64_t block = 0; block < kOfPatch; ++block) {
      Visibility::Packet& packet = packets.emplace_back();
      packet.from = patch;
      packet.count = 16;
      const auto u = static_cast<int>(random.next() % kBlocks), v = static_cast<int>(random.next() % kBlocks);
      for (std::size_t i = 0; i < 16; ++i) {
        const int k = static_cast<int>(i);
        const Vec3 x = visibility.scaled(points.at(r2_point(16 * block + i, shift)));
        const Sample2 disk = concentric_disk({(4 * u + k % 4 + random.uniform()) / (4 * kBlocks),
                                              (4 * v + k / 4 + random.uniform()) / (4 * kBlocks)});
        const double z = std::sqrt(std::max(0.0, 1 - disk.u * disk.u - disk.v * disk.v));
        const Vec3 d = disk.u * t + disk.v * b + z * mesh.normal(patch);
        packet.x[i] = static_cast<float>(x.x());
        packet.y[i] = static_cast<float>(x.y());
        packet.z[i] = static_cast<float>(x.z());
        packet.dx[i] = static_cast<float>(d.x());
        packet.dy[i] = static_cast<float>(d.y());
        packet.dz[i] = static_cast<float>(d.z());
      }
    }
  }
  return packets;
}

/// The same rays, one thread, through Visibility and through Embree: those of the pixels in packets, those of patches in packets, and
/// one by one in all directions.
void print_rays(const std::string& name, const PatchMesh& patches, const PatchMesh& faces,
                const Camera& camera, int width, int height) {
  const Visibility visibility(patches);
  const RawEmbree embree(visibility, faces);
  const Pinhole eye(camera, width, height);
  std::int64_t met = 0, met_by_embree = 0;  // used, or a compiler might leave the work out
  std::string columns;
  const auto add = [&](std::pair<double, double> seconds, double count) {
    columns += fmt::format(" {:.0f} | {:.0f} | {:.2f} |", 1e9 * seconds.first / count,
                           1e9 * seconds.second / count, seconds.first / seconds.second);
  };
  const auto add_packets = [&](std::vector<Visibility::Packet> packets) {
    std::vector<Visibility::Packet> raised = packets;
    double count = 0;
    // Embree alone has no planes to pass through: such rays start above them.
    for (Visibility::Packet& packet : raised) {
      count += packet.count;
      if (packet.from == Visibility::kNothing) continue;
      const Vec3 up = tolerance::kNearPlane * patches.normal(packet.from);
      for (std::size_t i = 0; i < 16; ++i) {
        packet.x[i] += static_cast<float>(up.x());
        packet.y[i] += static_cast<float>(up.y());
        packet.z[i] += static_cast<float>(up.z());
      }
    }
    add(fastest(
            [&] {
              for (Visibility::Packet& packet : packets) {
                visibility.first_hits(packet);
                met += packet.hit[0];
              }
            },
            [&] {
              for (const Visibility::Packet& packet : raised) met_by_embree += embree.packet(packet);
            }),
        count);
  };
  add_packets(packets_of_pixels(visibility, eye, width, height));
  add_packets(packets_of_patches(visibility, width * height / 16));

  std::mt19937_64 random(3);
  std::vector<Vec3> directions;
  for (int k = 0; k < width * height; ++k)
    directions.push_back(
        Vec3(test::uniform(random) - 0.5, test::uniform(random) - 0.5, test::uniform(random) - 0.5));
  const Vec3 from = visibility.scaled(eye.position());
  add(fastest(
          [&] {
            for (const Vec3& d : directions) met += visibility.first_hit(eye.position(), d).patch;
          },
          [&] {
            for (const Vec3& d : directions) met_by_embree += embree.single(from, d);
          }),
      static_cast<double>(directions.size()));
  fmt::print("| {} | {} | {} |{}{}\n", name, faces.triangles().size(), patches.patch_count(), columns,
             met == 0 && met_by_embree == 0 ? " nothing was met" : "");
}

void print_pipelines(const std::vector<BenchScene>& scenes, int width, int height, Index samples,
                     Index reference_samples) {
  fmt::print(
      "| scene | pipeline | making it, CPU s | drawing, CPU s | wall s | rays, 10⁶ | MB | RMS from path "
      "tracing, % of "
      "white |\n|---|---|---|---|---|---|---|---|\n");
  std::vector<std::string> noise;
  for (const BenchScene& scene : scenes) {
    const auto faces = std::make_shared<const PatchMesh>(make_patches(scene.scene, KeepFaces{}).mesh);
    SceneSettings settings;
    settings.patches = PatchSize{scene.patch_size};
    SolveOptions options;
    options.estimate_error = false;
    const SolvedScene solved = solve_scene(scene.scene, settings, options);
    const SolvedScene::Told told = solved.told_of_setup(0);
    const auto patches = std::make_shared<const PatchMesh>(told.mesh);
    const double exposure = automatic_exposure(*patches, told.solution.radiosity);
    const auto view_of = [&](const PipelineInfo& info) {
      std::vector<Light> lights = lights_of_emitters(*faces);
      lights.insert(lights.end(), scene.lights.begin(), scene.lights.end());
      ViewScene view{faces, {}, std::move(lights), ambient_irradiance(*faces, scene.lights)};
      // Ray tracing is over the solution, where its light is.
      if (info.solved || info.recursive) {
        view.mesh = patches;
        view.vertex_radiosity = told.solution.vertex_radiosity;
      }
      return view;
    };
    DrawOptions small{.width = std::max(1, width / 4), .height = std::max(1, height / 4), .samples = samples};
    DrawOptions many = small;
    many.samples = reference_samples;
    many.standard_error = true;
    const PipelineInfo& paths = find_pipeline("path-tracing");
    const LinearImage reference = paths.make(view_of(paths), {.seed = 7})->draw(scene.camera, many);
    const Judge judge(reference, exposure);
    for (const PipelineInfo& info : pipelines()) {
      Memory memory;
      memory.begin();
      std::unique_ptr<Pipeline> pipeline;
      PipelineOptions pipeline_options;
      if (info.recursive) pipeline_options.depth = 3;  // what the eye sees, and two bounces
      const Cost making = cost_of([&] { pipeline = info.make(view_of(info), pipeline_options); });
      const DrawOptions draw{.width = width, .height = height, .samples = samples};
      LinearImage image;
      const Cost drawing = cost_of([&] { image = pipeline->draw(scene.camera, draw); });
      const double megabytes = memory.most();
      fmt::print("| {} | `{}` | {:.2f} | {:.2f} | {:.2f} | {} | {:.0f} | {:.1f} |\n", scene.name, info.name,
                 making.cpu, drawing.cpu, drawing.wall,
                 image.rays > 0 ? fmt::format("{:.1f}", 1e-6 * static_cast<double>(image.rays)) : "–",
                 megabytes, 100 * judge.difference(pipeline->draw(scene.camera, small)));
      std::fflush(stdout);
    }
    noise.push_back(fmt::format("{} {:.1f} %", scene.name, 100 * judge.noise()));
  }
  fmt::print("\nNoise of the references: {}\n", fmt::join(noise, ", "));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Each pipeline on several scenes: prints Markdown tables"};
  int width = 800, height = 600;
  Index samples = 4, reference_samples = 400;
  std::string building, only;
  bool smallest = false, rays_only = false;
  app.add_option("--width", width)->capture_default_str();
  app.add_option("--height", height)->capture_default_str();
  app.add_option("--samples", samples, "per pixel")->capture_default_str();
  app.add_option("--reference-samples", reference_samples,
                 "paths per pixel of the reference, at a quarter of the width")
      ->capture_default_str();
  app.add_option("--building", building, "a scene file, shown beside the others");
  app.add_option("--scene", only, "only scenes whose name contains this");
  app.add_flag("--rays", rays_only, "the last table alone");
  app.add_flag("--smallest", smallest, "one scene and few pixels");
  CLI11_PARSE(app, argc, argv);
  const std::filesystem::path folder = RADIOSITY_SCENES;
  std::vector<std::function<BenchScene()>> makers{
      [&] { return from_file("Cornell box", folder / "cornell-box.toml", 0.02); },
      [&] { return from_file("Cornell box with mirror and glass", folder / "cornell-box-glass.toml", 0.03); },
      [&] { return from_file("two rooms", folder / "two-rooms.toml", 0.2); }, office};
  if (!building.empty())
    makers.emplace_back([&] { return from_file(std::filesystem::path(building).stem(), building, 0.5); });
  if (smallest) {
    makers.resize(1);
    width = 64;
    height = 48;
    samples = reference_samples = 2;
  }

  std::vector<BenchScene> scenes;
  for (const auto& make : makers) {
    BenchScene scene = make();
    if (scene.name.find(only) != std::string::npos) scenes.push_back(std::move(scene));
  }
  if (!rays_only) print_pipelines(scenes, width, height, samples, reference_samples);
  fmt::print(
      "\n| scene | triangles | patches | pixels, ns per ray | Embree's own | ratio | patches, ns | Embree's "
      "own "
      "| ratio | single rays, ns | Embree's own | ratio "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const BenchScene& scene : scenes)
    print_rays(scene.name, make_patches(scene.scene, PatchSize{scene.patch_size}).mesh.with_clusters({}),
               make_patches(scene.scene, KeepFaces{}).mesh, scene.camera, width, height);
  return 0;
}
