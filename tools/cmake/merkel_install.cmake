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
