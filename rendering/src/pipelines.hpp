// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "radiosity/rendering/pipeline.hpp"

namespace radiosity {

std::unique_ptr<Pipeline> make_gouraud(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_path_tracing(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_phong(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_priority(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_ray_tracing(ViewScene, const PipelineOptions&);
std::unique_ptr<Pipeline> make_second_pass(ViewScene, const PipelineOptions&);

}  // namespace radiosity
