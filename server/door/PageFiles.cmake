# cmake -DFOLDER=… -DOUTPUT=… -P PageFiles.cmake: the files of FOLDER that a browser gets, as a .cpp file with their
# texts.
file(GLOB files ${FOLDER}/*.html ${FOLDER}/*.css ${FOLDER}/*.js)
list(SORT files)
set(entries "")
foreach(file ${files})
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(FIND "${text}" ")page~\"" end)
  if(NOT end EQUAL -1)
    message(FATAL_ERROR "${file}: these characters end a text of C++")
  endif()
  string(APPEND entries "    {\"${name}\", R\"page~(${text})page~\"},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"server/door/PageFiles.h\"

namespace tessera {
namespace {

constexpr PageFile kFiles[] = {
${entries}};

}  // namespace

std::span<const PageFile> pageFiles() {
    return kFiles;
}

}  // namespace tessera
")
