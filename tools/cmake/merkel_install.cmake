# cmake --install: the libraries for find_package(merkel), and the program. The components are those
# of the Debian packages: runtime and development (merkel_packages.cmake).
include(CMakePackageConfigHelpers)
include(${CMAKE_CURRENT_LIST_DIR}/public_headers.cmake)
merkel_write_public_headers(${PROJECT_BINARY_DIR}/public_headers)
install(DIRECTORY ${PROJECT_BINARY_DIR}/public_headers/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/merkel COMPONENT development)

get_property(libraries GLOBAL PROPERTY MERKEL_LIBRARIES)
install(TARGETS ${libraries} EXPORT merkel_targets
  ARCHIVE COMPONENT development
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/merkel/private COMPONENT development)
install(EXPORT merkel_targets NAMESPACE merkel:: FILE merkel-targets.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/merkel COMPONENT development)
configure_package_config_file(
  ${CMAKE_CURRENT_LIST_DIR}/merkel-config.cmake.in ${PROJECT_BINARY_DIR}/merkel-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/merkel)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/merkel-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/merkel-config.cmake ${PROJECT_BINARY_DIR}/merkel-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/merkel COMPONENT development)

# The same for pkg-config: the static libraries, from the last to the first, and what they link.
set(links)
set(further)
foreach(library IN LISTS libraries)
  string(PREPEND links " -l${library}")
  get_target_property(linked ${library} INTERFACE_LINK_LIBRARIES)
  foreach(each IN LISTS linked)
    string(REGEX REPLACE "^[$]<LINK_ONLY:(.*)>$" "\\1" each "${each}")
    if(each MATCHES "^(.*)/lib([^/]+)[.](so|a)$")
      if(NOT CMAKE_MATCH_1 IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
        list(APPEND further -L${CMAKE_MATCH_1})
      endif()
      list(APPEND further -l${CMAKE_MATCH_2})
    elseif(each STREQUAL Threads::Threads)
      list(APPEND further -pthread)
    elseif(each MATCHES "^((hwy|LSL)::)?([a-z0-9.-]+)$")
      list(APPEND further -l${CMAKE_MATCH_3})
    endif()
  endforeach()
endforeach()
list(REMOVE_DUPLICATES further)
list(JOIN further " " further)
string(APPEND links " ${further}")
file(RELATIVE_PATH up /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" up "${up}")
configure_file(${CMAKE_CURRENT_LIST_DIR}/merkel.pc.in ${PROJECT_BINARY_DIR}/merkel.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/merkel.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

if(TARGET merkel)
  install(TARGETS merkel COMPONENT runtime)
  # udev and systemd look below /usr/lib, /usr/local/lib and /etc: another prefix is harmless.
  install(FILES ${PROJECT_SOURCE_DIR}/drivers/system/70-merkel.rules
    DESTINATION lib/udev/rules.d COMPONENT runtime)
  # The unit needs the path of the installed program, which is known only at installation.
  install(CODE "
    set(CMAKE_INSTALL_FULL_BINDIR \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}\")
    configure_file(\"${PROJECT_SOURCE_DIR}/drivers/system/merkel@.service.in\"
      \"${PROJECT_BINARY_DIR}/merkel@.service\" @ONLY)" COMPONENT runtime)
  install(FILES ${PROJECT_BINARY_DIR}/merkel@.service
    DESTINATION lib/systemd/system COMPONENT runtime)

  # Examples, found by name above the program (drivers/files/example_file).
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/examples ${PROJECT_SOURCE_DIR}/tests/traces
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/merkel COMPONENT runtime)

  # Shell completion, as the program prints it.
  if(NOT CMAKE_CROSSCOMPILING)
    set(completions)
    foreach(place bash-completion/completions/merkel fish/vendor_completions.d/merkel.fish zsh/vendor-completions/_merkel)
      string(REGEX MATCH "^[a-z]+" shell ${place})
      set(completion ${PROJECT_BINARY_DIR}/completion/${place})
      cmake_path(GET completion PARENT_PATH folder)
      cmake_path(GET place PARENT_PATH installed)
      file(MAKE_DIRECTORY ${folder})
      add_custom_command(OUTPUT ${completion} COMMAND merkel completion ${shell} > ${completion} VERBATIM)
      list(APPEND completions ${completion})
      install(FILES ${completion}
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/${installed} COMPONENT runtime OPTIONAL)
    endforeach()
    add_custom_target(merkel_completion ALL DEPENDS ${completions})
  endif()

  # The documents, with the folders that their links name.
  set(folders core drivers realtime tools tests)
  list(TRANSFORM folders PREPEND ${PROJECT_SOURCE_DIR}/)
  list(TRANSFORM folders APPEND /README.md)
  file(GLOB_RECURSE documents RELATIVE ${PROJECT_SOURCE_DIR} ${folders} ${PROJECT_SOURCE_DIR}/tools/guides/*.md)
  foreach(document README.md CHANGELOG.md ${documents})
    cmake_path(GET document PARENT_PATH folder)
    install(FILES ${PROJECT_SOURCE_DIR}/${document}
      DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder} COMPONENT runtime)
  endforeach()
  install(PROGRAMS ${PROJECT_SOURCE_DIR}/tools/brand_node
    DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples COMPONENT runtime)

  find_program(MERKEL_HELP2MAN help2man)
  find_program(MERKEL_GZIP gzip)
  if(MERKEL_HELP2MAN AND MERKEL_GZIP)
    add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/merkel.1.gz
      COMMAND ${CMAKE_CURRENT_LIST_DIR}/man_page.sh $<TARGET_FILE:merkel> ${PROJECT_VERSION}
        ${PROJECT_BINARY_DIR}/merkel.1.gz
      DEPENDS merkel ${CMAKE_CURRENT_LIST_DIR}/man_page.sh VERBATIM)
    add_custom_target(merkel_man ALL DEPENDS ${PROJECT_BINARY_DIR}/merkel.1.gz)
    install(FILES ${PROJECT_BINARY_DIR}/merkel.1.gz
      DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime OPTIONAL)
  else()
    message(STATUS "Without help2man: no man page (tools/install_packages package)")
  endif()
  if(PROJECT_IS_TOP_LEVEL)
    include(merkel_packages)
  endif()
endif()
