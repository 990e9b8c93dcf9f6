# cmake -DOUT=file.cpp -DFILES="page.html;…" -P embed_page.cmake: the page's files as C++ text.
set(code "#include \"drivers/sinks/view/page_files.hpp\"\nnamespace merkel {\nnamespace {\nconstexpr PageFile kFiles[] = {\n")
foreach(path IN LISTS FILES)
  get_filename_component(name ${path} NAME)
  file(READ ${path} text)
  string(APPEND code "{\"${name}\", R\"~page~(${text})~page~\"},\n")
endforeach()
string(APPEND code "};\n}\nstd::span<const PageFile> page_files() noexcept { return kFiles; }\n}\n")
file(WRITE ${OUT} "${code}")
