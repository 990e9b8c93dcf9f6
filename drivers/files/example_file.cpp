#include "drivers/files/example_file.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <dlfcn.h>

namespace merkel {
namespace {

namespace fs = std::filesystem;

struct ExampleFolder {
  const char* name;
  const char* extension;
};

ExampleFolder folder_of(Example kind) {
  return kind == Example::kScene ? ExampleFolder{"share/merkel/examples", ".toml"}
                                 : ExampleFolder{"share/merkel/traces", ".csv"};
}

/// The nearest such folder above a program or library.
fs::path folder_above(fs::path file, const char* name) {
  std::error_code failed;
  file = fs::canonical(file, failed);
  if (failed) return {};
  for (fs::path at = file.parent_path();; at = at.parent_path()) {
    if (fs::is_directory(at / name, failed)) return at / name;
    if (at == at.root_path()) return {};
  }
}

/// Of this copy of merkel: above the library that contains it (a Python module), or the program.
fs::path examples_folder(Example kind) {
  const char* const name = folder_of(kind).name;
  Dl_info library{};
  const void* const here = reinterpret_cast<const void*>(&example_names);
  if (::dladdr(here, &library) != 0 && library.dli_fname != nullptr && *library.dli_fname == '/') {
    if (fs::path found = folder_above(library.dli_fname, name); !found.empty()) return found;
  }
  return folder_above("/proc/self/exe", name);
}

}  // namespace

std::vector<std::string> example_names(Example kind) {
  std::vector<std::string> names;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(examples_folder(kind), failed)) {
    if (entry.path().extension() == folder_of(kind).extension) {
      names.push_back(entry.path().stem().string());
    }
  }
  std::ranges::sort(names);
  return names;
}

std::string path_or_example(Example kind, const std::string& path) {
  std::error_code failed;
  if (path.find_first_of("/.") != std::string::npos || fs::exists(path, failed)) return path;
  const fs::path example = examples_folder(kind) / (path + folder_of(kind).extension);
  return !path.empty() && fs::is_regular_file(example, failed) ? example.string() : path;
}

}  // namespace merkel
