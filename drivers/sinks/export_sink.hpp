#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/sink.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A sink whose format needs the whole run, such as HDF5 with the spikes of each unit together: the
/// file is made from the run's journal at the end. The journal is SinkSetup::journal; without one
/// it is a session beside the file, which survives a kill and is removed once the file is complete.
class ExportSink final : public Sink {
 public:
  /// Writes the file. Returns the reason if it cannot; then it leaves no incomplete file.
  using Make = std::function<Expected<void, std::string>(RunJournal&, const TimeBase&)>;

  /// Fails if the file exists (unless `overwrite`), cannot be a file, or is being written by
  /// another program.
  [[nodiscard]] static OpenedSink open(const Uri& uri, const SinkSetup& setup, TimeBase time,
                                       Make make);
  /// The name of the session beside a file.
  [[nodiscard]] static std::string journal_name(const std::string& path) {
    return path + ".journal.xdf";
  }
  /// The setup for files of killed runs: its notices say how to make the file from them.
  [[nodiscard]] static SinkSetup recovering(const Uri& uri, SinkSetup setup);

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return session_ ? session_->subscriptions() : kKinds<SpikeEvent>;
  }
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override;
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override;
  [[nodiscard]] Expected<void, SinkError> flush() override;
  [[nodiscard]] Expected<void, SinkError> close() override;

 private:
  ExportSink(const Uri& uri, const SinkSetup& setup, TimeBase time, Make make);

  std::string path_;
  Make make_;
  std::shared_ptr<RunJournal> journal_;  ///< null: `session_` is it
  std::unique_ptr<Sink> session_;
  std::function<void(const std::string&)> progress_;
  TimeBase time_;
  std::uint64_t taken_ = 0;
};

}  // namespace merkel
