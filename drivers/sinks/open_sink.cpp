#include "drivers/sinks/open_sink.hpp"

#include "drivers/sinks/csv_spike_sink.hpp"
#include "drivers/uri.hpp"

namespace merkel {

Expected<std::unique_ptr<SpikeSink>, SetupError> open_sink(std::string_view text,
                                                           const NeuronNumbering& numbering,
                                                           bool overwrite) {
  const auto uri = Uri::parse(text);
  if (!uri) return Unexpected<SetupError>(uri.error());
  const UriOptions options(*uri);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (uri->scheme == "csv") {
    return CsvSpikeSink::open(uri->text, uri->path, numbering, overwrite);
  }
  return bad_input("\"" + uri->text + "\": there is no sink scheme \"" + uri->scheme +
                   "\"; known is csv:FILE");
}

}  // namespace merkel
