#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <hdf5.h>

#include "drivers/files/hdf5_file.hpp"
#include "drivers/files/hdf5_handle.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/spike_files/recorded_zero.hpp"
#include "drivers/spike_files/spike_file.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// Bytes of values for a stored byte: more than HDF5's compression can give.
constexpr std::uint64_t kMaxCompression = 2000;
constexpr double kMaxTime_ns = 4e18;

bool has_object(hid_t file, const std::string& path) {
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    if (H5Lexists(file, path.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

/// A list of numbers, or what is there instead.
template <class Value>
Expected<std::vector<Value>, std::string> numbers(hid_t file, const std::string& path, hid_t type) {
  const auto fault = [&](const std::string& what) {
    return Unexpected<std::string>(path + " " + what);
  };
  if (!has_object(file, path)) return fault("is missing");
  const Hdf5Handle dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.valid()) return fault("is not a dataset");
  const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose);
  const Hdf5Handle own_type(H5Dget_type(dataset.id()), H5Tclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  const int dimensions = H5Sget_simple_extent_ndims(space.id());
  const H5T_class_t kind = H5Tget_class(own_type.id());
  if (kind != H5T_INTEGER && kind != H5T_FLOAT) return fault("does not hold numbers");
  if (dimensions != 1) {
    return fault(dimensions == 0 ? "is a single value instead of a list"
                                 : "has " + std::to_string(dimensions) +
                                       " dimensions instead of one: store a list");
  }
  // A file of a few bytes can declare any number of values.
  const std::uint64_t stored_bytes = H5Dget_storage_size(dataset.id());
  if (count < 0 || static_cast<std::uint64_t>(count) / kMaxCompression > stored_bytes) {
    return fault("declares more values than the file can hold");
  }
  std::vector<Value> values(static_cast<std::size_t>(count));
  if (count > 0 && H5Dread(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return fault("is damaged");
  }
  return values;
}

/// A single text of variable length.
std::optional<std::string> text_at(hid_t file, const std::string& path) {
  if (!has_object(file, path)) return std::nullopt;
  const Hdf5Handle dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle own_type(H5Dget_type(dataset.id()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose);
  if (H5Tis_variable_str(own_type.id()) <= 0 || H5Sget_simple_extent_npoints(space.id()) != 1) {
    return std::nullopt;
  }
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  H5Tset_cset(type.id(), H5Tget_cset(own_type.id()));
  char* text = nullptr;
  const bool read = H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) >= 0;
  if (!read || text == nullptr) return std::nullopt;
  std::string copy = text;
  H5free_memory(text);
  return copy;
}

/// Adds a spike. False if its time or number is impossible.
bool add(SpikeFile& file, double time_ns, std::uint64_t neuron) {
  if (!(std::fabs(time_ns) < kMaxTime_ns) || neuron == 0 || neuron > UINT32_MAX) return false;
  file.spikes.push_back(
      {.time = nanoseconds{std::llround(time_ns)}, .neuron = static_cast<std::uint32_t>(neuron)});
  return true;
}

Unexpected<std::string> impossible(std::uint64_t spike) {
  return Unexpected<std::string>("spike " + std::to_string(spike) +
                                 " has an impossible time or number of its neuron");
}

/// Reads the units, which count from 0. Fails with what is wrong.
Expected<void, std::string> read_nwb(hid_t hdf5, SpikeFile& file, RecordedZero& zero) {
  if (!has_object(hdf5, "/units")) return Unexpected<std::string>("it has no /units");
  const auto times_s = numbers<double>(hdf5, "/units/spike_times", H5T_NATIVE_DOUBLE);
  if (!times_s) return Unexpected<std::string>(times_s.error());
  const auto ends = numbers<std::int64_t>(hdf5, "/units/spike_times_index", H5T_NATIVE_INT64);
  if (!ends) return Unexpected<std::string>(ends.error());
  zero.take_all(text_at(hdf5, "/general/notes").value_or(""));
  const auto misfit = Unexpected<std::string>("/units/spike_times_index does not fit spike_times");
  if (std::cmp_not_equal(ends->empty() ? 0 : ends->back(), times_s->size())) return misfit;
  std::size_t i = 0;
  for (std::size_t unit = 0; unit < ends->size(); ++unit) {
    if (std::cmp_less((*ends)[unit], i) || std::cmp_greater((*ends)[unit], times_s->size())) {
      return misfit;
    }
    for (; std::cmp_less(i, (*ends)[unit]); ++i) {
      if (!add(file, (*times_s)[i] * 1e9, unit + 1)) return impossible(i);
    }
  }
  return {};
}

}  // namespace

Expected<SpikeFile, SetupError> read_nwb_spikes(const std::string& path) {
  const std::lock_guard lock(hdf5_mutex());
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are printed by the caller
  const Hdf5Handle hdf5(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!hdf5.valid()) return bad_input("cannot read " + path + ": HDF5 refused");
  ReadFiles::note(path);
  SpikeFile file{.format = "NWB", .spikes = {}};
  RecordedZero zero;
  if (const auto read = read_nwb(hdf5.id(), file, zero); !read) {
    return bad_input(path + " has no spikes of NWB (/units), or is damaged: " + read.error());
  }
  file.from_start = zero.apply(file.spikes);
  return file;
}

}  // namespace merkel
