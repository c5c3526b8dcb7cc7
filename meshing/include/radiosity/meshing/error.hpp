// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace radiosity {

/// Base of everything this toolkit throws. The message names object, value and rule.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The scene, a parameter or a request breaks a rule.
class InputError : public Error {
 public:
  using Error::Error;
};

/// A request needs more memory than it may have.
class MemoryLimitError : public InputError {
 public:
  using InputError::InputError;
};

/// A file cannot be read, understood or written.
class IoError : public Error {
 public:
  using Error::Error;
};

}  // namespace radiosity
