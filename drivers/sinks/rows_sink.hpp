#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "drivers/sink.hpp"
#include "drivers/sinks/file_sink.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A sink whose format is HDF5. It collects the run as rows of text in FILE.part, which survives
/// any crash, and converts them at the end of the run. HDF5 does not guarantee that an unclosed
/// file can be read, and it cannot continue after a failed write.
class RowsSink : public FileSink {
 public:
  /// Opens the file of rows. Fails if the path cannot be an HDF5 file or cannot be written.
  [[nodiscard]] static Expected<OutputFile, SetupError> open_rows(const Uri& uri,
                                                                  const SinkSetup& setup);
  /// The rows of a killed run and their description.
  struct Recovered {
    const std::string& rows;               ///< their file
    nlohmann::json content;                ///< as of content_lines()
    RunOrigin origin = {};                 ///< the run's
    std::chrono::nanoseconds offset = {};  ///< probe time − time in the rows
  };
  /// Converts a killed run's rows, which were renamed to `recovered`: `convert` writes the file
  /// `recovered` or returns the reason why it cannot.
  /// \param what  the subject of the notice after a failure, such as "its spikes are"
  static void convert_recovered(
      const std::string& recovered, const std::string& what, const SinkSetup& setup,
      const std::function<Expected<void, std::string>(const Recovered& run)>& convert);

  /// The start of the lines at the head of the rows that hold the description of the run.
  static constexpr std::string_view kContentMark = "# content=";

  [[nodiscard]] Expected<void, SinkError> close() override;

 protected:
  /// \param what  the subject of the error after a failed conversion, such as "all spikes are"
  RowsSink(std::string uri, OutputFile rows, TimeBase time, bool overwrite, std::string_view what);

  /// Called once, after the origin of time is set.
  /// \return the rest of the head: content_lines(), and perhaps a line of column names
  [[nodiscard]] virtual std::string head(const RunOrigin& origin) = 0;
  /// Writes the HDF5 file. On failure, returns the reason.
  [[nodiscard]] virtual Expected<void, std::string> convert(const std::string& path,
                                                            bool overwrite) = 0;

  /// Lines that store the description of the run with its rows, so that a later run converts them
  /// as they are.
  [[nodiscard]] static std::string content_lines(const nlohmann::json& content);
  /// Writes rows that contain `spikes` spikes.
  [[nodiscard]] Expected<void, SinkError> write_rows(std::string_view text, std::size_t spikes = 0);
  [[nodiscard]] const TimeBase& time() const noexcept { return time_; }
  /// The file of the rows.
  [[nodiscard]] const std::string& rows() const noexcept { return file().part(); }

 private:
  [[nodiscard]] Expected<void, SinkError> start(const RunOrigin& origin) final;

  std::string path_;
  TimeBase time_;
  bool overwrite_;
  std::string what_;
};

}  // namespace merkel
