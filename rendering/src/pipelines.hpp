// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/rendering/pipeline.hpp"

namespace radiosity {

/// Places of a pixel's samples: in each of the n columns and n rows that it is divided into there is one, in its middle, so that edges
/// near either axis have n + 1 shades. The ranks of the R2 sequence, whose beginnings are spread over the pixel as well. One sample is
/// in the middle.
std::vector<Sample2> sample_places(Index n);

std::unique_ptr<Pipeline> make_gouraud(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_path_tracing(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_phong(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_priority(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_ray_tracing(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_second_pass(ViewScene, const PipelineOptions&);

}  // namespace radiosity
