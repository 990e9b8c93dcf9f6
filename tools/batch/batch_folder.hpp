#pragma once

#include <map>
#include <string>

#include "core/expected.hpp"
#include "drivers/files/owned_descriptor.hpp"
#include "tools/batch/batch_job.hpp"
#include "tools/batch/text_table.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// The folder of a batch, as merkel.batch() of Python writes it: rows.jsonl has the outcome of each
/// finished job, results.csv the table.
class BatchFolder {
 public:
  /// Creates the folder and reads the outcomes of an earlier batch. Fails if another batch uses it,
  /// or if it has a table or a file of the name of a kept one that no batch has written there.
  [[nodiscard]] static Expected<BatchFolder, SetupError> open(const std::string& path,
                                                              const std::vector<BatchJob>& jobs);

  /// The outcome of a job that was done, with its file; null otherwise.
  [[nodiscard]] Json finished(const std::string& id) const;
  /// Records an outcome at once. Safe to call from several processes. False after an error.
  [[nodiscard]] bool add(const std::string& id, const Json& outcome) const;
  /// Reads the outcomes that other processes have added.
  void refresh();
  /// Writes results.csv: a row for each job that has an outcome.
  [[nodiscard]] Expected<void, SetupError> write_table(const TextTable& jobs,
                                                       const std::vector<BatchJob>& ids) const;
  /// The outcome of a job, done or failed; null if there is none.
  [[nodiscard]] const Json* outcome(const std::string& id) const;

 private:
  BatchFolder(std::string path, OwnedDescriptor file)
      : path_(std::move(path)), file_(std::move(file)) {}

  std::string path_;
  OwnedDescriptor file_;
  std::map<std::string, Json> outcomes_;
  std::map<std::string, std::string> job_of_file_;  ///< that wrote it last, by its id
};

}  // namespace merkel
