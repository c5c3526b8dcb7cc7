// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/threads.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <optional>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

struct ThreadLimit::Impl {
  std::optional<tbb::global_control> control;
};

ThreadLimit::ThreadLimit(int threads) : impl_(std::make_unique<Impl>()) {
  if (threads < 0) throw InputError(fmt::format("threads: {} is negative; 0 means every core", threads));
  if (threads > 0) {
    impl_->control.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  }
}

ThreadLimit::~ThreadLimit() = default;

}  // namespace radiosity
