# cmake -DSOURCE=folder -DOUT=file.cpp -P git_hash.cmake: the built commit, as C++ text.
# In a source archive, the commit it was made from. Written only if changed, so that nothing else is rebuilt.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=40 --exclude *
  OUTPUT_VARIABLE hash OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT hash)
  set(hash $Format:%H$)  # git archive fills this in
  if(hash MATCHES "Format")
    set(hash unknown)
  endif()
endif()
set(code "namespace merkel {\nextern const char* const kGitHash;\nconst char* const kGitHash = \"${hash}\";\n}\n")
if(EXISTS ${OUT})
  file(READ ${OUT} old)
endif()
if(NOT "${old}" STREQUAL "${code}")
  file(WRITE ${OUT} "${code}")
endif()
