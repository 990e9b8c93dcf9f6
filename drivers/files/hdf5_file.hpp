#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// Held during every use of HDF5, which has global state and is not thread-safe.
[[nodiscard]] std::mutex& hdf5_mutex();

/// Writes one HDF5 file. Objects are named by their path; missing groups on the way are made. After
/// a failure every call does nothing, and the file is not kept: see write_hdf5_file(). Texts are of
/// variable length and UTF-8.
class Hdf5File {
 public:
  enum class Type : std::uint8_t { kDouble, kInt64, kUint64, kUint32, kUint8 };

  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  void group(const std::string& path);

  void attribute(const std::string& path, const char* name, const std::string& text);
  void attribute(const std::string& path, const char* name, std::span<const std::string> texts);
  void attribute(const std::string& path, const char* name, float value);
  void attribute(const std::string& path, const char* name, double value);
  void attribute(const std::string& path, const char* name, std::int32_t value);
  void attribute(const std::string& path, const char* name, std::uint32_t value);
  void attribute(const std::string& path, const char* name, std::span<const std::uint32_t> values);
  /// One of some words, as an enumeration of bytes.
  void word(const std::string& path, const char* name, std::span<const char* const> words,
            std::uint8_t index);
  /// A reference to another object of the file.
  void reference(const std::string& path, const char* name, const std::string& target);

  /// Makes a second name for an object.
  void link(const std::string& path, const std::string& target);

  /// A single number.
  void number(const std::string& path, double value);
  /// A single text.
  void text(const std::string& path, const std::string& value);
  /// A list of texts that can grow.
  void texts(const std::string& path, std::span<const std::string> values);

  /// A growing list of numbers, or of rows of `width` numbers.
  class Column {
   public:
    Column(Hdf5File& file, const std::string& path, Type type, std::size_t width = 1);
    Column(const Column&) = delete;
    Column& operator=(const Column&) = delete;
    /// Writes the buffered data.
    ~Column();
    void append(double value);
    void append(std::uint64_t value);
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }

   private:
    template <class Value>
    void write(std::vector<Value>& values, std::int64_t memory_type);
    void flush();

    Hdf5File& file_;
    std::int64_t dataset_;
    std::size_t width_;
    std::uint64_t written_ = 0;  ///< rows
    std::uint64_t size_ = 0;     ///< values
    std::vector<double> doubles_;
    std::vector<std::uint64_t> wholes_;
  };

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  /// The outcome of reading what is to be written: after an error the file is not kept.
  void take(const Expected<void, std::string>& read) {
    if (read) return;
    ok_ = false;
    reason_ = read.error();
  }

 private:
  friend Expected<void, std::string> write_hdf5_file(const std::string& path, bool overwrite,
                                                     const std::function<void(Hdf5File&)>& write);
  explicit Hdf5File(const std::string& path);
  ~Hdf5File();
  void check(bool succeeded) noexcept { ok_ = ok_ && succeeded; }
  void close();
  void write_attribute(const std::string& path, const char* name, std::int64_t type,
                       std::int64_t space, const void* value);

  std::int64_t file_;
  bool ok_;
  std::string reason_;  ///< of take()
};

/// Writes a whole HDF5 file under another name, forces it to the disk and gives it its name. On
/// failure, leaves no file of that name and returns the reason. One file at a time: HDF5 is not
/// built for several threads. Real-time: no.
[[nodiscard]] Expected<void, std::string> write_hdf5_file(
    const std::string& path, bool overwrite, const std::function<void(Hdf5File&)>& write);

}  // namespace merkel
