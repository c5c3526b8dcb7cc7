// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <string_view>

#include "commands.hpp"
#include "processes.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "terminal.hpp"

namespace {

using namespace radiosity::app;

// One line, whatever library the message is from.
int fail(const Processes& processes, int status, std::string_view message) {
  std::string line;
  for (const char c : message) {
    const bool after_break = line.ends_with("; ");
    if (c == '\n')
      line += after_break ? "" : "; ";
    else if (c != ' ' || !after_break)
      line += c;
  }
  processes.wait_to_tell();
  std::fflush(stdout);
  fmt::print(stderr, "radiosity: error: {}\n", line);
  processes.end_all(status);
  return status;
}

int run(const Options& options) {
  const radiosity::ThreadLimit threads(options.threads);
  if (options.command == "solve") return run_solve(options);
  if (options.command == "factors") return run_factors(options);
  if (options.command == "inspect") return run_inspect(options);
  if (options.command == "probe") return run_probe(options);
  if (options.command == "compare") return run_compare(options);
  return run_view(options);
}

}  // namespace

int main(int argc, char** argv) {
  Processes processes;
  try {
    auto options = parse_command_line(argc, argv);
    if (!options) return kDone;
    processes.share(*options);
    catch_interrupts();
    return run(*options);
  } catch (const UsageError& e) {
    return fail(processes, kBadUsage, e.what());
  } catch (const std::bad_alloc&) {
    return fail(processes, kBadInput, "out of memory; a larger --patch-size or --memory-limit may help");
  } catch (const std::exception& e) {
    return fail(processes, kBadInput, e.what());
  }
}
