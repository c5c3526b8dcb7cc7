// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "radiosity/rendering/pinhole.hpp"
#include "radiosity/rendering/view_scene.hpp"

namespace radiosity {

/// An image in physical units: π L, the radiosity in W/m² of a perfect diffuser as bright as what is seen. A diffuse surface shows
/// its radiosity B.
struct LinearImage {
  int width = 0, height = 0;
  BandArray radiosity = {};  ///< pixels, row by row from the top, × bands
  std::optional<BandArray> standard_error =
      {};                  ///< of the mean of the samples, the same shape, where it was asked for
  std::uint64_t rays = 0;  ///< that were cast for it; 0 of pipelines that cast none
  Index samples = 0;       ///< per pixel; 0: not every pixel was looked at, pixels stand for their neighbours
  bool completed = true;   ///< false: `refined` or `stop` asked to stop
};

struct DrawOptions {
  int width = 800, height = 600;
  Index samples = 4;  ///< per pixel, at places spread over it; their mean is the pixel
  /// Samples brighter than this, in W/m², count as this: a lamp's edge is then as smooth as any other on a display that shows no more.
  /// It would take light from pixels whose samples are random.
  double brightest = std::numeric_limits<double>::infinity();
  bool standard_error = false;  ///< wanted; it needs at least two samples
  /// Called on the calling thread with better and better images: from 1/16 of the pixels, from 1/4, from all, then with each further
  /// sample. False asks to stop. Without it the coarse ones are not drawn; the last image has the same bits.
  std::function<bool(const LinearImage&)> refined = {};
  /// Asked often and on many threads; once true it stays true. It ends the pass under way, whose samples are lost: the image is that of
  /// the passes before. The first is always finished.
  std::function<bool()> stop = {};
};

/// One point in each square of stride × stride pixels, numbered row by row from the top.
struct SampleGrid {
  int width, height;                            ///< of the image
  int stride;                                   ///< pixels
  double x, y;                                  ///< in [0, 1): place in the square, from its left and top
  Index sample;                                 ///< which of each pixel's samples
  const std::function<bool()>* stop = nullptr;  ///< whether no more of them are wanted; null: all are
  bool stopped() const { return stop && (*stop)(); }
  int columns() const { return (width + stride - 1) / stride; }
  int rows() const { return (height + stride - 1) / stride; }
  double u(int column) const { return (column + x) * stride / width; }
  double v(int row) const { return (row + y) * stride / height; }
};

struct PipelineOptions {
  std::uint64_t seed = 1;  ///< of the random numbers of path tracing, one stream per pixel and sample
  int depth = 16;          ///< of ray tracing: most surfaces that a ray is followed over, at least 1
  /// Of ray tracing, as it was at first: f_att is at most 1, and what is mirrored or refracted is multiplied by min(1, 1/d), d in m to
  /// what it shows. Radiance does not fall along a ray, so this is off by default.
  bool classical_attenuation = false;
  /// Of local lighting, m: what is seen d metres away falls by exp(−d / attenuation_length), as in air that absorbs (depth cueing).
  double attenuation_length = std::numeric_limits<double>::infinity();
};

/// A way to make a picture. One object serves one scene, whatever the camera. Pipelines only look at points of the image plane: places
/// of samples, their mean and their error, and coarse images are the duty of `draw`, which all share. Tone mapping comes after it.
class Pipeline {
 public:
  virtual ~Pipeline() = default;
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Throws InputError on an image without pixels or samples, a camera without a view, or one inside of a wall or a thing: what it sees
  /// is black, and so is what it would see whatever way it looked, the backs of surfaces that let no light through.
  LinearImage draw(const Camera& camera, const DrawOptions& options = {}) const;

 protected:
  /// Throws InputError where the scene is not valid.
  explicit Pipeline(ViewScene scene);

  const ViewScene& scene() const { return scene_; }
  const PatchMesh& mesh() const { return *scene_.mesh; }

  /// π L in W/m² that arrives at `eye` through each point of the grid; the void is 0. values: points × bands, 0 when it is called. The
  /// answer depends neither on the number of threads nor on other calls.
  virtual void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const = 0;
  /// Cast so far.
  virtual std::uint64_t rays() const { return 0; }

 private:
  ViewScene scene_;
};

/// Throws InputError, naming camera and nearest surface, where an eye sees nothing but backs of surfaces that let no light through whatever
/// way it looks: inside of a wall or a thing.
void refuse_eye_in_matter(const PatchMesh& mesh, const Camera& camera);

/// A row of the table of pipelines.
struct PipelineInfo {
  std::string_view name;
  std::string_view summary;   ///< one line for --help
  std::string_view citation;  ///< keys of references.bib
  bool solved;                ///< draws a solution: the scene needs vertex_radiosity
  bool random;     ///< its samples are random: there is a seed, and their mean has a standard error
  bool recursive;  ///< follows mirrored and refracted rays to PipelineOptions::depth
  bool local;  ///< lights each surface by itself, in air that PipelineOptions::attenuation_length tells of
  std::unique_ptr<Pipeline> (*factory)(ViewScene scene, const PipelineOptions& options);

  /// Throws InputError where the scene is not valid or lacks the solution that is needed.
  std::unique_ptr<Pipeline> make(ViewScene scene, const PipelineOptions& options = {}) const;
};

/// All pipelines. Tests, benchmarks and the command line read this table.
std::span<const PipelineInfo> pipelines();

/// Throws InputError that lists the names there are.
const PipelineInfo& find_pipeline(std::string_view name);

}  // namespace radiosity
