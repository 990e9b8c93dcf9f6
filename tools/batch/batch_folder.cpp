#include "tools/batch/batch_folder.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "drivers/files/file_rename.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/output_file.hpp"

namespace merkel {
namespace {

std::string cell_of(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  return value.is_null() ? "" : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

Expected<BatchFolder, SetupError> BatchFolder::open(const std::string& path,
                                                    const std::vector<BatchJob>& jobs) {
  std::error_code failed;
  std::filesystem::create_directories(path, failed);
  const std::string table = path + "/" + BatchKeep::kTable;
  const std::string journal = path + "/rows.jsonl";
  for (const std::string& output : {table, journal}) {
    if (auto unread = ReadFiles::check_not_read(output); !unread) {
      return Unexpected<SetupError>(unread.error());
    }
  }
  const auto foreign = [](const std::string& file) {
    return bad_input("cannot write " + file +
                     ": it exists, and no batch has written it; move it, or use another folder");
  };
  if (!file_exists(journal) && file_exists(table)) return foreign(table);
  OwnedDescriptor file(
      ::open((path + "/rows.jsonl").c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (file.get() < 0) {
    return bad_input("cannot write " + path + "/rows.jsonl: " + std::strerror(errno));
  }
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    return bad_input("another batch is writing to " + path +
                     ": wait for its end, or use another folder");
  }
  BatchFolder folder(path, std::move(file));
  folder.refresh();
  for (const BatchJob& job : jobs) {
    if (job.name.empty() || job.file.empty() || folder.job_of_file_.contains(job.file)) continue;
    if (file_exists(path + "/" + job.file)) return foreign(path + "/" + job.file);
  }
  // A line that a killed process left unfinished.
  const off_t size = ::lseek(folder.file_.get(), 0, SEEK_END);
  char last = '\n';
  if (size > 0 && ::pread(folder.file_.get(), &last, 1, size - 1) == 1 && last != '\n' &&
      ::write(folder.file_.get(), "\n", 1) != 1) {
    return bad_input("cannot write " + path + "/rows.jsonl: " + std::strerror(errno));
  }
  return folder;
}

void BatchFolder::refresh() {
  std::ifstream file(path_ + "/rows.jsonl");
  for (std::string line; std::getline(file, line);) {
    Json row = Json::parse(line, nullptr, false);
    if (!row.is_object() || !row["id"].is_string() || !row["status"].is_string()) continue;
    const auto id = row["id"].get<std::string>();
    row.erase("id");
    if (const std::string name = cell_of(row.value("file", Json(""))); !name.empty()) {
      job_of_file_[name] = id;
    }
    outcomes_[id] = std::move(row);
  }
}

const Json* BatchFolder::outcome(const std::string& id) const {
  const auto at = outcomes_.find(id);
  return at == outcomes_.end() ? nullptr : &at->second;
}

Json BatchFolder::finished(const std::string& id) const {
  const Json* const found = outcome(id);
  if (found == nullptr || found->at("status") != "done") return {};
  const std::string file = cell_of(found->value("file", Json("")));
  if (file.empty()) return *found;
  // A job of the same name may have replaced the file since.
  const bool own = job_of_file_.at(file) == id;
  return own && file_exists(path_ + "/" + file) ? *found : Json();
}

bool BatchFolder::add(const std::string& id, const Json& outcome) const {
  Json row = {{"id", id}};
  row.update(outcome);
  const std::string line = row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  // One call: the lines of several processes do not mix.
  return ::write(file_.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size());
}

Expected<void, SetupError> BatchFolder::write_table(const TextTable& jobs,
                                                    const std::vector<BatchJob>& ids) const {
  auto file = OutputFile::create(path_ + "/" + BatchKeep::kTable, true);
  if (!file) return Unexpected<SetupError>(file.error());
  std::vector<std::string> cells = {"job", "id"};
  const auto add = [&](const std::vector<std::string>& more) {
    cells.insert(cells.end(), more.begin(), more.end());
  };
  add(jobs.columns);
  add(outcome_columns());
  std::string text = table_line(cells);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Json* const found = outcome(ids[i].id);
    if (found == nullptr) continue;
    cells = {std::to_string(i), ids[i].id};
    add(jobs.rows[i]);
    for (const std::string& column : outcome_columns()) {
      cells.push_back(cell_of(found->value(column, Json())));
    }
    text += table_line(cells);
  }
  if (!file->write(text) || !file->close()) return bad_input(file->error());
  return {};
}

}  // namespace merkel
