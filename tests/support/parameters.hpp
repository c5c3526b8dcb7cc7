// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

namespace radiosity::test {

/// Names of parameterised tests: those of the tables, without the characters that gtest refuses.
template <class Info>
std::string test_name(const testing::TestParamInfo<const Info*>& info) {
  std::string name(info.param->name);
  std::erase(name, '-');
  return name;
}

template <class Info>
std::vector<const Info*> pointers(std::span<const Info> table) {
  std::vector<const Info*> all;
  for (const Info& info : table) all.push_back(&info);
  return all;
}

}  // namespace radiosity::test
