#include "drivers/sinks/phy_spike_sink.hpp"

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/output_file.hpp"

namespace merkel {
namespace {

constexpr std::uint64_t kBuffered = 65536;  ///< spikes that wait for a flush

std::int64_t sample_of(std::chrono::nanoseconds time, double sample_rate_hz) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  // Whole seconds apart, so that large times lose no digits.
  return static_cast<std::int64_t>(sample_rate_hz) * whole.count() +
         std::llround(units::s_from(time - whole) * sample_rate_hz);
}

}  // namespace

PhySpikeSink::PhySpikeSink(std::string uri, double sample_rate_hz, NpyFile times, NpyFile clusters,
                           NpyFile templates)
    : uri_(std::move(uri)),
      sample_rate_hz_(sample_rate_hz),
      times_(std::move(times)),
      clusters_(std::move(clusters)),
      templates_(std::move(templates)) {}

Expected<std::unique_ptr<SpikeSink>, SetupError> PhySpikeSink::open(const Uri& uri,
                                                                    const SinkSetup& setup) {
  UriOptions options(uri);
  const auto rate_hz =
      static_cast<double>(options.whole("sample_rate", 1'000'000, 1000, 1'000'000'000));
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  const std::string& folder = uri.path;
  if (folder.empty()) return bad_input("\"" + uri.text + "\": name the folder to write: phy:DIR");
  const bool made = ::mkdir(folder.c_str(), 0777) == 0;
  if (!made && (errno != EEXIST || !setup.overwrite)) {
    return bad_input(errno == EEXIST
                         ? folder + " exists already: give --overwrite, or another name"
                         : "cannot make the folder " + folder + ": " + std::strerror(errno) +
                               (errno == ENOENT ? "; make its parent first" : ""));
  }
  auto parameters = OutputFile::create(folder + "/params.py", setup.overwrite);
  if (!parameters) return Unexpected<SetupError>(parameters.error());
  if (!parameters->write("# Spikes simulated by merkel; there is no raw recording.\n"
                         "dat_path = ''\nn_channels_dat = 1\ndtype = 'int16'\noffset = 0\n"
                         "sample_rate = " +
                         shortest_decimal(rate_hz) + "\nhp_filtered = True\n") ||
      !parameters->close()) {
    return unavailable(parameters->error());
  }
  auto times = NpyFile::create(folder + "/spike_times.npy", "<i8", setup.overwrite);
  if (!times) return Unexpected<SetupError>(times.error());
  auto clusters = NpyFile::create(folder + "/spike_clusters.npy", "<i4", setup.overwrite);
  if (!clusters) return Unexpected<SetupError>(clusters.error());
  auto templates = NpyFile::create(folder + "/spike_templates.npy", "<i4", setup.overwrite);
  if (!templates) return Unexpected<SetupError>(templates.error());
  std::unique_ptr<PhySpikeSink> sink(new PhySpikeSink(uri.text, rate_hz, std::move(*times),
                                                      std::move(*clusters), std::move(*templates)));
  if (made) sink->folder_ = folder;
  return sink;
}

PhySpikeSink::~PhySpikeSink() {
  if (closed_ || taken_ > 0 || folder_.empty()) return;
  for (const char* const name :
       {"params.py", "spike_times.npy", "spike_clusters.npy", "spike_templates.npy"}) {
    ::unlink((folder_ + "/" + name).c_str());
  }
  ::rmdir(folder_.c_str());
}

Expected<void, SinkError> PhySpikeSink::settle(bool succeeded) {
  if (!succeeded) {
    for (const NpyFile* const file : {&times_, &clusters_, &templates_}) {
      if (!file->error().empty()) return Unexpected<SinkError>({.sentence = file->error()});
    }
  }
  delivered_ = taken_;
  return {};
}

Expected<void, SinkError> PhySpikeSink::write(std::span<const SpikeEvent> spikes) {
  for (const SpikeEvent& spike : spikes) {
    times_.append(sample_of(spike.time, sample_rate_hz_));
    clusters_.append(spike.neuron);
    templates_.append(spike.neuron);
  }
  taken_ += spikes.size();
  if (taken_ - delivered_ < kBuffered) return {};
  return flush();
}

Expected<void, SinkError> PhySpikeSink::flush() {
  return settle(times_.flush() && clusters_.flush() && templates_.flush());
}

Expected<void, SinkError> PhySpikeSink::close() {
  closed_ = true;
  return flush();
}

}  // namespace merkel
