#include <string>
#include <utility>

#include "drivers/files/output_file.hpp"
#include "drivers/sinks/export_sink.hpp"
#include "drivers/sinks/sonata_file.hpp"

namespace merkel {

OpenedSink open_sonata_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  SonataContent content{.population = options.text("population", "merkel"),
                        .afferents = afferents_of(setup)};
  TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (content.population.empty() ||
      content.population.find_first_of("/.\" \t") != std::string::npos) {
    return bad_input("\"" + uri.text +
                     "\": the option population must be a name without /, ., quotes and blanks");
  }
  if (auto free = check_writable(node_types_name(uri.path), setup.overwrite); !free) {
    return Unexpected<SetupError>(free.error());
  }
  return ExportSink::open(uri, setup,
                          [path = uri.path, content = std::move(content), time,
                           overwrite = setup.overwrite](auto& journal, const auto& origin) mutable {
                            time.set(origin);
                            return write_sonata(path, content, time, journal, overwrite);
                          });
}

}  // namespace merkel
