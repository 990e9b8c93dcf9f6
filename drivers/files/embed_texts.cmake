# merkel_embed(NAME SOURCE FILES…): a source that defines NAME, a span of EmbeddedText, with the
# content of the files; it changes by itself, so it is joined with no other. As a script, it writes that source.
set(merkel_embed_script ${CMAKE_CURRENT_LIST_FILE})
function(merkel_embed name source)
  add_custom_command(OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DOUT=${source} "-DFILES=${ARGN}" -P ${merkel_embed_script}
    DEPENDS ${ARGN} ${merkel_embed_script} VERBATIM)
  set_source_files_properties(${CMAKE_CURRENT_BINARY_DIR}/${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
if(NOT CMAKE_SCRIPT_MODE_FILE)
  return()
endif()

set(code "#include \"drivers/files/embedded_text.hpp\"\nnamespace merkel {\nnamespace {\nconstexpr EmbeddedText ${NAME}Files[] = {\n")
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(APPEND code "{\"${name}\", R\"~embedded~(${text})~embedded~\"},\n")
endforeach()
string(APPEND code "};\n}\nextern const std::span<const EmbeddedText> ${NAME};\nconst std::span<const EmbeddedText> ${NAME}(${NAME}Files);\n}\n")
file(WRITE ${OUT} "${code}")
