#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/files/npy_file.hpp"
#include "drivers/sink.hpp"
#include "drivers/sinks/afferent_table.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Writes spikes to a folder for Phy and Neo: `spike_times.npy` (in samples of 1 µs, or of the
/// option sample_rate), `spike_clusters.npy` and `spike_templates.npy` (neurons from 1),
/// `channel_map.npy` and `channel_positions.npy` (one entry per afferent, µm), `afferents.csv` and
/// `params.py`. The folder is locked; files are NAME.part until the end of the run.
class PhySink final : public Sink {
 public:
  /// Creates the folder of the URI's path; its parent must exist. Options: sample_rate, time.
  [[nodiscard]] static Expected<std::unique_ptr<Sink>, SetupError> open(const Uri& uri,
                                                                        const SinkSetup& setup);
  /// Removes the folder if nothing was written and close() was not called.
  ~PhySink() override;

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override;
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override;
  [[nodiscard]] Expected<void, SinkError> flush() override;
  [[nodiscard]] Expected<void, SinkError> close() override;
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  enum File : std::size_t { kTimes, kClusters, kTemplates };
  struct Folder {
    std::string path;
    int lock = -1;
    bool made = false;
  };
  PhySink(const Uri& uri, const SinkSetup& setup, double sample_rate_hz, TimeBase time,
          Folder folder);
  static Expected<Folder, SetupError> lock_folder(const std::string& path, const SinkSetup& setup);
  Expected<void, SetupError> open_files();
  Expected<void, SetupError> write_parameters();
  Expected<void, SetupError> write_channels();
  [[nodiscard]] std::string in_folder(const char* name) const { return folder_.path + "/" + name; }
  template <class Action>
  Expected<void, SinkError> for_all(Action action);

  std::string uri_;
  Folder folder_;
  bool overwrite_;
  double sample_rate_hz_;
  TimeBase time_;
  std::vector<AfferentRow> afferents_;
  std::vector<NpyFile> files_;  ///< indexed by File
  bool started_ = false;
  bool closed_ = false;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace merkel
