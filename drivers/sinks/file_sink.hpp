#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "drivers/files/output_file.hpp"
#include "drivers/sink.hpp"

namespace merkel {

/// A sink that writes one file: its head, once the origin of the run is known or before the first
/// records, and then the records.
class FileSink : public Sink {
 public:
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) final {
    if (std::exchange(started_, true)) return {};
    return start(origin);
  }
  [[nodiscard]] Expected<void, SinkError> flush() override { return settle(file_.flush()); }
  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    return settle(file_.close());
  }
  void give_up() noexcept final { file_.give_up(); }

 protected:
  FileSink(std::string uri, OutputFile file) : Sink(std::move(uri)), file_(std::move(file)) {}

  /// Writes the head; called once.
  [[nodiscard]] virtual Expected<void, SinkError> start(const RunOrigin& origin) = 0;
  /// The file's error, unless `written`. \param spikes  number of spikes just written
  [[nodiscard]] Expected<void, SinkError> settle(bool written, std::size_t spikes = 0) {
    taken_ += spikes;
    if (!written) return Unexpected<SinkError>({.sentence = file_.error()});
    if (file_.settled()) delivered_ = taken_;
    return {};
  }
  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] OutputFile& file() noexcept { return file_; }
  [[nodiscard]] const OutputFile& file() const noexcept { return file_; }

 private:
  OutputFile file_;
  bool started_ = false;
  std::uint64_t taken_ = 0;
};

}  // namespace merkel
