#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/parameters/position.hpp"
#include "core/parameters/range.hpp"

namespace merkel {

/// A value chosen from a list of words: an index into Field::range.words, or none.
struct Choice {
  void* value;
  std::optional<std::size_t> (*get)(const void* value);
  void (*set)(void* value, std::size_t index);
};

/// The largest seed: whole numbers of a scene file (TOML) have 64 bits with a sign.
inline constexpr std::uint64_t kMaxSeed = INT64_MAX;

/// Pointer to a parameter's value. An empty optional selects a default that depends on other
/// values; Field::absent describes it.
using FieldPointer =
    std::variant<double*, int*, std::int64_t*, std::uint64_t*, bool*, std::string*,
                 std::chrono::nanoseconds*, Choice, std::vector<double>*, std::vector<Position>*,
                 std::optional<double>*, std::optional<int>*, std::optional<std::int64_t>*,
                 std::optional<std::chrono::nanoseconds>*, std::optional<Position>*>;

/// The unit of a text for which a scene may also write a whole number.
inline constexpr std::string_view kNameOrNumber = "name or number";

/// One parameter of a struct, with everything that the check, the reader and writer of scenes, and
/// the documents need. Times are std::chrono::nanoseconds in the struct and numbers in `unit` ("µs"
/// or "ms") outside.
struct Field {
  std::string_view key;      ///< its name in a scene, for example "radius_mm"
  std::string_view unit;     ///< for display, for example "mm"; empty: none
  Range range;               ///< the allowed values
  std::string_view meaning;  ///< a phrase without a full stop
  FieldPointer (*in)(void* parameters);
  std::string_view absent = {};  ///< of an optional or an empty text: the default when not set
  bool fitted = false;           ///< may be changed by `merkel fit`
};

/// The parameters of one struct, in reading order. A struct with parameters has `static FieldTable
/// fields()`; a new parameter is one line in it.
struct FieldTable {
  std::string_view name;  ///< the scene table that contains them, for example "skin"
  std::span<const Field> fields;
};

/// A parameter of a particular object.
struct BoundField {
  std::string_view table;
  const Field* field;
  FieldPointer value;
  /// The words of a choice: from the field's range, or defined by the scene itself.
  std::vector<std::string> words;

  /// The name in a scene file, for example "skin.poisson_ratio".
  [[nodiscard]] std::string name() const;
};
using BoundFields = std::vector<BoundField>;

/// Appends the parameters of an object; the object is borrowed. Real-time: no.
void bind_fields(const FieldTable& table, void* parameters, BoundFields& fields);
template <class P>
void bind_fields(P& parameters, BoundFields& fields) {
  bind_fields(P::fields(), &parameters, fields);
}
template <class P>
[[nodiscard]] BoundFields bind_fields(P& parameters) {
  BoundFields fields;
  bind_fields(P::fields(), &parameters, fields);
  return fields;
}

/// The error in the value of a field, as "must be …, but is …"; empty if the value is valid.
/// Real-time: no.
[[nodiscard]] std::string fault_of(const BoundField& field);

/// Nanoseconds per `unit`.
[[nodiscard]] double nanoseconds_of_unit(std::string_view unit) noexcept;

namespace detail {

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

template <class Enum>
Choice choice_of(Enum& value) {
  return {&value,
          [](const void* at) -> std::optional<std::size_t> {
            return static_cast<std::size_t>(*static_cast<const Enum*>(at));
          },
          [](void* at, std::size_t index) { *static_cast<Enum*>(at) = static_cast<Enum>(index); }};
}

template <class Enum>
Choice choice_of(std::optional<Enum>& value) {
  return {&value,
          [](const void* at) -> std::optional<std::size_t> {
            const auto& enumerator = *static_cast<const std::optional<Enum>*>(at);
            return enumerator ? std::optional(static_cast<std::size_t>(*enumerator)) : std::nullopt;
          },
          [](void* at, std::size_t index) {
            *static_cast<std::optional<Enum>*>(at) = static_cast<Enum>(index);
          }};
}

template <class T>
FieldPointer pointer_to(T& value) {
  if constexpr (std::is_enum_v<T>) {
    return choice_of(value);
  } else if constexpr (kIsOptional<T>) {
    if constexpr (std::is_enum_v<typename T::value_type>) {
      return choice_of(value);
    } else {
      return &value;
    }
  } else {
    return &value;
  }
}

template <class P, class T>
P owner_of(T P::*);

}  // namespace detail

/// For Field::in: the member of a struct, as in at<&SkinParameters::radius_mm>.
template <auto Member>
FieldPointer at(void* parameters) {
  using P = decltype(detail::owner_of(Member));
  return detail::pointer_to(static_cast<P*>(parameters)->*Member);
}

}  // namespace merkel
