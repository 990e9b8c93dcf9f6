# Compiler settings of all targets, and the function that makes a library of a folder.

# Warnings; errors if CMAKE_COMPILE_WARNING_AS_ERROR is on.
add_library(merkel_warnings INTERFACE)
target_compile_options(merkel_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wold-style-cast
  # Parameters are filled by designated initialisers; every field has a default.
  -Wno-missing-field-initializers
  # g++ 12 reports false overlaps and overflows in std::string (GCC bugs 105651 and 105329), and
  # g++ 14 false frees of vectors' inner pointers.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow> $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
  $<$<CXX_COMPILER_ID:GNU>:-Wno-free-nonheap-object>)

# Arithmetic with the same bits on every machine: no implicit contraction of a·b+c, and nothing of
# -ffast-math. The two enabled flags do not change results.
add_library(merkel_numerics INTERFACE)
target_compile_options(merkel_numerics INTERFACE
  -ffp-contract=off -fno-math-errno -fno-trapping-math)

# All 64-bit ARM processors have NEON: Highway need not choose at run time. If it does, it requires AES
# instructions with NEON, which a Raspberry Pi 4 lacks, and g++ 12 crashes on its SVE header.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  set(MERKEL_HIGHWAY_ON_ARM TOOLCHAIN_MISS_SYS_AUXV_H HWY_COMPILE_ONLY_STATIC)
endif()

# A fault in a reader of outside bytes must end the program, not run an attacker's code. Checked on
# the built program by tests/project/hardening_test.sh.
# (Position-independent libraries can go into a shared module as well.)
include(CheckPIESupported)
check_pie_supported(LANGUAGES CXX)
if(NOT DEFINED CMAKE_POSITION_INDEPENDENT_CODE)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
endif()
add_library(merkel_hardening INTERFACE)
if(NOT MERKEL_SANITIZE)
  set(hardening -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2 -fstack-protector-strong
    $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|i.86")
    list(APPEND hardening -fcf-protection=full)
  endif()
  target_compile_options(merkel_hardening INTERFACE "$<$<CONFIG:Release>:${hardening}>")
  target_link_options(merkel_hardening INTERFACE
    "$<$<CONFIG:Release>:LINKER:-z,relro,-z,now,-z,noexecstack>")
endif()

add_library(merkel_sanitizers INTERFACE)
if(MERKEL_SANITIZE)
  target_compile_options(merkel_sanitizers INTERFACE
    -fsanitize=${MERKEL_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1)
  target_link_options(merkel_sanitizers INTERFACE -fsanitize=${MERKEL_SANITIZE})
  target_compile_definitions(merkel_sanitizers INTERFACE MERKEL_SANITIZED)
  if(MERKEL_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID MATCHES Clang)
    # Fuzz targets see which branches their inputs take.
    target_compile_options(merkel_sanitizers INTERFACE -fsanitize=fuzzer-no-link)
  endif()
endif()

# merkel_precompile(merkel_core): precompiles the standard headers that most sources include,
# once per target. Sources and headers still include what they use: the sanitizer builds and the test of
# headers do not use the precompiled ones.
function(merkel_precompile target)
  if(NOT MERKEL_SANITIZE)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <array> <chrono> <cmath> <cstddef> <cstdint> <cstring> <fstream> <functional>
      <map> <memory> <optional> <span> <sstream> <string> <string_view> <thread> <utility> <vector>
      <tl/expected.hpp>)
  endif()
endfunction()

# merkel_optimise_less(merkel_drivers): for what computes little. A third less time to compile.
function(merkel_optimise_less target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# merkel_join_sources(merkel_tools): compiles sixteen sources as one in optimised builds, in less than
# half the time. Names in the anonymous namespaces of a library must differ; the preset `lint` checks
# that. Every other build compiles each source alone.
function(merkel_join_sources target)
  if(CMAKE_BUILD_TYPE MATCHES "Release|Sanitize")
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 16)
  endif()
endfunction()

# merkel_library(merkel_scene tools/scene): settings of the library of a folder, which programs
# link as merkel::scene.
function(merkel_library target folder)
  get_filename_component(name ${folder} NAME)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.hpp)
  target_sources(${target} PUBLIC FILE_SET HEADERS
    BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${headers})
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF
    EXPORT_NAME ${name})
  target_include_directories(${target} PUBLIC
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/merkel/private>)
  target_link_libraries(${target} PRIVATE
    $<BUILD_INTERFACE:merkel_warnings> $<BUILD_INTERFACE:merkel_numerics>
    $<BUILD_INTERFACE:merkel_hardening> $<BUILD_INTERFACE:merkel_sanitizers>)
  merkel_precompile(${target})
  merkel_join_sources(${target})
  add_library(merkel::${name} ALIAS ${target})
  set_property(GLOBAL APPEND PROPERTY MERKEL_LIBRARIES ${target})
endfunction()
