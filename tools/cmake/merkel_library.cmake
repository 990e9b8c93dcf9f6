# What every target of the project is compiled with, and how a folder becomes a library.

# Warnings; errors where CMAKE_COMPILE_WARNING_AS_ERROR is on.
add_library(merkel_warnings INTERFACE)
target_compile_options(merkel_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wold-style-cast
  # Parameters are filled by designated initialisers; every field has a default.
  -Wno-missing-field-initializers
  # g++ 12 sees overlaps in std::string that are not there (GCC bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)

# Arithmetic that gives the same bits on every machine: no contraction of a·b+c behind our back, and
# none of -ffast-math. The two flags that are on change no result.
add_library(merkel_numerics INTERFACE)
target_compile_options(merkel_numerics INTERFACE
  -ffp-contract=off -fno-math-errno -fno-trapping-math)

add_library(merkel_sanitizers INTERFACE)
if(MERKEL_SANITIZE)
  target_compile_options(merkel_sanitizers INTERFACE
    -fsanitize=${MERKEL_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1)
  target_link_options(merkel_sanitizers INTERFACE -fsanitize=${MERKEL_SANITIZE})
  target_compile_definitions(merkel_sanitizers INTERFACE MERKEL_SANITIZED)
endif()

# merkel_library(merkel_core core): the settings of the library of a folder. Each .hpp file below it
# must compile alone (target <library>_verify_…).
function(merkel_library target folder)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.hpp)
  target_sources(${target} PUBLIC FILE_SET HEADERS
    BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${headers})
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF
    EXPORT_NAME ${folder}
    VERIFY_INTERFACE_HEADER_SETS ON)
  target_include_directories(${target} PUBLIC
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/merkel/private>)
  target_link_libraries(${target} PRIVATE
    $<BUILD_INTERFACE:merkel_warnings> $<BUILD_INTERFACE:merkel_numerics>
    $<BUILD_INTERFACE:merkel_sanitizers>)
  add_library(merkel::${folder} ALIAS ${target})
  set_property(GLOBAL APPEND PROPERTY MERKEL_LIBRARIES ${target})
endfunction()
