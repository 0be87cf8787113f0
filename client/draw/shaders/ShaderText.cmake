# cmake -DFOLDER=… -DOUTPUT=… -P ShaderText.cmake: the texts of FOLDER/*.glsl as a .cpp file. NAME.glsl is kNAME of
# ShaderText.h. A file begins with a comment for those who read it; the text begins with the empty line behind that.
file(GLOB files ${FOLDER}/*.glsl)
list(SORT files)
set(texts "")
foreach(file ${files})
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  string(FIND "${text}" "\n\n" head)
  if(NOT text MATCHES "^// " OR head EQUAL -1)
    message(FATAL_ERROR "${file}: a comment and an empty line come first")
  endif()
  if(text MATCHES "\\)glsl\"")
    message(FATAL_ERROR "${file}: these characters end a text of C++: )glsl\"")
  endif()
  math(EXPR head "${head} + 1")
  string(SUBSTRING "${text}" ${head} -1 text)
  string(APPEND texts "const char k${name}[] = R\"glsl(${text})glsl\";\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"client/draw/shaders/ShaderText.h\"

namespace tessera::shader_text {

${texts}
}  // namespace tessera::shader_text
")
