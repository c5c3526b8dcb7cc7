// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "radiosity/io/read_scene.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity {

class Attributes;

/// A number for a scene, its set-ups and the settings in force: all that decides what a solve gives, to the last bit.
std::uint64_t digest(const LoadedScene& loaded, const SceneSettings& settings, bool close);

/// The state of a long solve in files beside its result: rows of F in NAME.checkpoint.h5, of several ranks those of each in
/// NAME.checkpoint-2-of-4.h5, where rows are shot and not kept the shots in NAME.checkpoint-shots.h5, elements in
/// NAME.checkpoint-elements.h5. Each appears under its name only when complete, in the place of an earlier one. Any number of ranks goes on with what any other number left; all of them read the files.
class Checkpoints {
 public:
  /// For the result OUT.vtp of work with this digest, saved at most every `seconds`.
  Checkpoints(const std::filesystem::path& result, std::uint64_t work, const std::string& version,
              double seconds, std::shared_ptr<const Ranks> ranks = {});

  /// Whether an earlier run left any.
  bool found() const;
  /// Reads what an earlier run left. Throws InputError where that is of other work or another version, IoError where it cannot be read.
  void resume();
  /// On this rank.
  Index resumed_rows() const { return rows_ ? rows_->done : 0; }
  Index resumed_shots() const { return shots_ ? static_cast<Index>(shots_->history.size()) - 1 : 0; }
  Index resumed_elements() const { return elements_ ? static_cast<Index>(elements_->irradiance.rows()) : 0; }

  /// Lets a solve begin with what was read, and save its state; it refers to this object.
  void connect(SolveOptions& options);
  /// There is a result: the files go.
  void remove() const;

 private:
  class Clock;
  /// All that hold rows, whatever run left them.
  std::vector<std::filesystem::path> rows_files() const;
  PartialRows read_rows(const std::filesystem::path& file) const;
  void require_same_work(const std::filesystem::path& file, const Attributes& attributes) const;

  std::filesystem::path result_, rows_file_, shots_file_, elements_file_;
  std::uint64_t work_;
  std::string version_;
  double seconds_;
  std::shared_ptr<const Ranks> ranks_;
  std::shared_ptr<const PartialRows> rows_;
  std::shared_ptr<const ShootingState> shots_;
  std::shared_ptr<const PartialProbe> elements_;
};

}  // namespace radiosity
