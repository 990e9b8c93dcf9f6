#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "tools/python/src/records.hpp"

namespace merkel::python {

/// Takes an object from Python only if its constructor has run: X.__new__(X) alone makes an object
/// without a content, of which pybind11 would read raw memory. \throws Error
template <class T>
class Initialised : public pybind11::detail::type_caster_base<T> {
 public:
  bool load(pybind11::handle source, bool convert) {
    using pybind11::detail::values_and_holders;
    if (PyObject_TypeCheck(source.ptr(), this->typeinfo->type) != 0) {
      auto* const instance = reinterpret_cast<pybind11::detail::instance*>(source.ptr());
      for (const auto& part : values_and_holders(instance)) {
        if (!part.holder_constructed()) {
          throw Error(std::string("this ") + Py_TYPE(source.ptr())->tp_name +
                      " is empty, because only __new__ made it: call the class or function that "
                      "makes one");
        }
      }
    }
    return pybind11::detail::type_caster_base<T>::load(source, convert);
  }
};

}  // namespace merkel::python
