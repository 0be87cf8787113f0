# How every library, program and test of Tessera is made. A module is a folder: all its .cpp files but main.cpp.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(THREADS_PREFER_PTHREAD_FLAG ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

find_program(TESSERA_CCACHE ccache)
if(TESSERA_CCACHE)
  # With precompiled headers ccache has to be told that nothing looks at __TIME__ or at macros of the command line in
  # them. It asks the compiler which headers a file has read: to preprocess each file first would take a tenth of the
  # first build's time.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
    CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_DEPEND=1 ${TESSERA_CCACHE})
endif()

add_library(tessera_flags INTERFACE)
target_compile_options(tessera_flags INTERFACE -Wall -Wextra -Wshadow -Wno-missing-field-initializers)
# g++ would collect garbage rather often for files that are compiled together: a tenth of the time is less without.
# The largest take 2.4 GiB (deploy/build knows).
target_compile_options(tessera_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=2097152>)
# g++ 12 sees overlaps in std::string concatenations that are not there (GCC bug 105651).
target_compile_options(tessera_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
# g++ 12.2 at -O2 drops the rounding of (double)(float)x where it vectorises two of them in straight code. Bounds and
# exact answers live by that rounding (found by SupportProfile.HoldsEveryMappedPoint).
target_compile_options(tessera_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>)
# Names and lines of what programs run, for debuggers (deploy/packages keeps them apart): 7 % more time to compile.
# Tests leave them away.
set(TESSERA_SYMBOLS -g1 -gz)
if(TESSERA_SANITIZE)
  set(TESSERA_SYMBOLS)
endif()
set(TESSERA_KERNEL_OPTIMIZATION -O3)
if(TESSERA_SANITIZE)
  set(TESSERA_KERNEL_OPTIMIZATION -O1)
  # At -O1: at -O3 g++ takes five times as long over the checks as over the code.
  # Undefined behaviour ends a program as an error of memory does: a line in a log that nobody reads is no finding.
  target_compile_options(tessera_flags INTERFACE -fsanitize=${TESSERA_SANITIZE} -fno-sanitize-recover=all
    -fno-omit-frame-pointer -g1 -O1)
  target_link_options(tessera_flags INTERFACE -fsanitize=${TESSERA_SANITIZE})
endif()
if(TESSERA_FUZZ)
  target_compile_options(tessera_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()

option(TESSERA_SYNTAX_ONLY "Look at each file, and make nothing of it" OFF)
if(TESSERA_SYNTAX_ONLY)
  target_compile_options(tessera_flags INTERFACE -fsyntax-only)
  set(CMAKE_CXX_COMPILER_LAUNCHER)
  # Objects of one module wait for the libraries and programs of others, and there is nothing to make these from.
  set(CMAKE_CXX_ARCHIVE_CREATE "<CMAKE_COMMAND> -E touch <TARGET>")
  set(CMAKE_CXX_ARCHIVE_FINISH "<CMAKE_COMMAND> -E true")
  set(CMAKE_CXX_LINK_EXECUTABLE "<CMAKE_COMMAND> -E touch <TARGET>")
  set(CMAKE_CXX_CREATE_SHARED_MODULE "<CMAKE_COMMAND> -E touch <TARGET>")
endif()

# Files of one module or test are compiled together, so that what headers bring is worked out once for all of them. With
# g++, and where the sanitizers run: each file alone under clang (run-tests --all=clang) finds what a file forgets to
# include itself. OFF makes single files quicker to compile again.
set(unite OFF)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR TESSERA_SANITIZE)
  set(unite ON)
endif()
option(TESSERA_UNITY "Compile the files of a module together" ${unite})

# Headers of others are read once for all modules and once for all tests: of a test's compile time more than half was
# theirs.
set(TESSERA_PRECOMPILE OFF)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR TESSERA_UNITY)
  set(TESSERA_PRECOMPILE ON)
  set(CMAKE_PCH_WARN_INVALID ON)
  set(tessera_headers <Eigen/Core> <Eigen/Geometry> <tl/expected.hpp> <algorithm> <array> <atomic> <bit> <chrono>
    <cmath> <cstdint> <cstring> <deque> <filesystem> <functional> <limits> <map> <memory> <mutex> <numeric> <optional>
    <ranges> <set> <span> <string> <string_view> <thread> <unordered_map> <unordered_set> <utility> <variant> <vector>)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled.cpp CONTENT "int main() {}\n")
endif()

function(tessera_unite name)
  if(TESSERA_UNITY)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 40)
  endif()
endfunction()

# tessera_precompile(NAME KIND headers…): the target whose headers others reuse. KIND: OBJECT or an executable's
# (empty), because the two are not compiled alike.
function(tessera_precompile name kind)
  if(kind STREQUAL "OBJECT")
    add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
  else()
    add_executable(${name} ${CMAKE_BINARY_DIR}/precompiled.cpp)
  endif()
  target_compile_definitions(${name} PRIVATE EIGEN_MAX_ALIGN_BYTES=16)
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()

# What runs seldom, or waits for others: a fifth of the time of compiling it is worth more than some of its speed.
function(tessera_runs_seldom target)
  target_compile_options(${target} PRIVATE -O1)
endfunction()

# tessera_reuse_precompiled(TARGET [seldom]): headers of others, read once. One set for each way of compiling: g++ 12
# takes the optimisation level of the precompiled header, whatever the command line of the file says.
function(tessera_reuse_precompiled target)
  set(headers tessera_precompiled)
  target_compile_options(${target} PRIVATE ${TESSERA_SYMBOLS})
  if("${ARGN}" STREQUAL "seldom")
    tessera_runs_seldom(${target})
    set(headers tessera_precompiled_seldom)
  endif()
  if(NOT TESSERA_PRECOMPILE)
    return()
  endif()
  if(NOT TARGET ${headers})
    tessera_precompile(${headers} OBJECT ${tessera_headers})
    target_link_libraries(${headers} PRIVATE Eigen3::Eigen tessera_flags)
    target_compile_options(${headers} PRIVATE ${TESSERA_SYMBOLS})
    if("${ARGN}" STREQUAL "seldom")
      tessera_runs_seldom(${headers})
    endif()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${headers})
endfunction()

# Small modules that are compiled together, into one library: half of a small module's compile time is what its files
# share with those of its neighbours. A group is made before its modules; nothing outside
# it that they link may link one of them.
#
# tessera_group(NAME [SELDOM] modules…)
function(tessera_group group)
  cmake_parse_arguments(ARG "SELDOM" "" "" ${ARGN})
  add_library(tessera_${group} STATIC)
  foreach(module ${ARG_UNPARSED_ARGUMENTS})
    set_property(GLOBAL PROPERTY TESSERA_GROUP_OF_${module} tessera_${group})
  endforeach()
  tessera_module_settings(tessera_${group} ${ARG_SELDOM})
endfunction()

# tessera_module_settings(TARGET [TRUE]): what every library of ours is compiled with. TRUE: it runs seldom.
function(tessera_module_settings target)
  tessera_unite(${target})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>
    $<INSTALL_INTERFACE:include/tessera>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # One alignment for Eigen in every translation unit, ours and an application's.
  target_compile_definitions(${target} PUBLIC EIGEN_MAX_ALIGN_BYTES=16)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:tessera_flags>)
  if("${ARGN}" STREQUAL "TRUE")
    tessera_reuse_precompiled(${target} seldom)
  else()
    tessera_reuse_precompiled(${target})
  endif()
endfunction()

# tessera_library(NAME [SELDOM] [ONLY regex | BUT regex] [LINK other modules and packages...]): the module in the
# current folder. ONLY, BUT: of its files those, or all others, where a folder has two libraries.
function(tessera_library name)
  cmake_parse_arguments(ARG "SELDOM" "ONLY;BUT" "LINK;PRIVATE_LINK" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  if(ARG_ONLY)
    list(FILTER sources INCLUDE REGEX "${ARG_ONLY}")
  elseif(ARG_BUT)
    list(FILTER sources EXCLUDE REGEX "${ARG_BUT}")
  endif()
  # Kernels and predicates have options of their own.
  set(special ${sources})
  list(FILTER special INCLUDE REGEX "(Sse2|Sse41|Avx2|Avx512|/Predicates|/HullSupport|/ExactDescent)\\.cpp$")
  get_property(group GLOBAL PROPERTY TESSERA_GROUP_OF_${name})
  if(group)
    # The module is a name for the group's library, and for its own kernels: options of files are known in their own
    # folder only.
    list(REMOVE_ITEM sources ${special})
    target_sources(${group} PRIVATE ${sources})
    add_library(tessera_${name} INTERFACE)
    target_link_libraries(tessera_${name} INTERFACE ${group})
    foreach(link ${ARG_LINK})
      string(REGEX REPLACE "^tessera_" "" module "${link}")
      get_property(other GLOBAL PROPERTY TESSERA_GROUP_OF_${module})
      if(NOT other STREQUAL group)
        target_link_libraries(${group} PUBLIC ${link})
      endif()
    endforeach()
    foreach(link ${ARG_PRIVATE_LINK})
      string(REGEX REPLACE "^tessera_" "" module "${link}")
      get_property(other GLOBAL PROPERTY TESSERA_GROUP_OF_${module})
      if(NOT other STREQUAL group)
        target_link_libraries(${group} PRIVATE ${link})
      endif()
    endforeach()
    if(special)
      add_library(tessera_${name}_kernels STATIC ${special})
      tessera_module_settings(tessera_${name}_kernels)
      target_link_libraries(tessera_${name}_kernels PRIVATE Eigen3::Eigen)
      target_link_libraries(${group} PUBLIC tessera_${name}_kernels)
    endif()
  elseif(sources)
    add_library(tessera_${name} STATIC ${sources})
    tessera_module_settings(tessera_${name} ${ARG_SELDOM})
    target_link_libraries(tessera_${name} PUBLIC ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
  else()
    add_library(tessera_${name} INTERFACE)
    target_include_directories(tessera_${name} INTERFACE $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>
      $<INSTALL_INTERFACE:include/tessera>)
    target_link_libraries(tessera_${name} INTERFACE ${ARG_LINK})
  endif()
  if(special)
    set_source_files_properties(${special} PROPERTIES SKIP_PRECOMPILE_HEADERS ON SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
  set_target_properties(tessera_${name} PROPERTIES EXPORT_NAME ${name})
endfunction()

# tessera_reuse_headers(NAME): as the modules have them, for a library of tests.
function(tessera_reuse_headers name)
  tessera_unite(${name})
  tessera_reuse_precompiled(${name} seldom)
endfunction()

# All that a person starts: what run-wall, run-tests and install build, and deploy/build links into out/bin. Each
# program enters itself.
add_custom_target(programs)
function(tessera_offer name)
  add_dependencies(programs ${name})
  set_property(GLOBAL APPEND PROPERTY TESSERA_PROGRAMS ${name})
endfunction()

# tessera_program(NAME LINK … [HELPER]): main.cpp of the current folder, which reads options and calls a library. A
# HELPER is started by other programs alone.
function(tessera_program name)
  cmake_parse_arguments(ARG "HELPER" "" "LINK;SOURCES" ${ARGN})
  if(NOT ARG_SOURCES)
    set(ARG_SOURCES main.cpp)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} tessera_flags)
  # Compiled as the modules are, so that their headers serve here too.
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(${name} PRIVATE -fPIC)
  target_compile_definitions(${name} PRIVATE EIGEN_MAX_ALIGN_BYTES=16)
  tessera_reuse_precompiled(${name} seldom)
  set(folder bin)
  if(ARG_HELPER)
    set(folder libexec/tessera)
  endif()
  install(TARGETS ${name} RUNTIME DESTINATION ${folder} COMPONENT programs)
  tessera_offer(${name})
endfunction()

# tessera_reuse_headers_for_tests(NAME): of a program of our own tests, compiled at -O1.
function(tessera_reuse_headers_for_tests name)
  if(TESSERA_SYMBOLS)
    target_link_options(${name} PRIVATE -Wl,--strip-debug)
  endif()
  if(TESSERA_PRECOMPILE)
    if(NOT TARGET tessera_precompiled_for_tests)
      tessera_precompile(tessera_precompiled_for_tests "" <gtest/gtest.h> <fmt/format.h> <random> <sstream> <fstream>
        ${tessera_headers})
      target_link_libraries(tessera_precompiled_for_tests PRIVATE Eigen3::Eigen GTest::gtest fmt::fmt tessera_flags)
      target_compile_options(tessera_precompiled_for_tests PRIVATE -O1)
    endif()
    target_precompile_headers(${name} REUSE_FROM tessera_precompiled_for_tests)
  endif()
endfunction()

# tessera_entry(NAME COMMAND … [SHARDS n [SUITES]] [FILTER filter] [PROPERTIES …]): one entry of ctest, or as many as
# there are shards (tests/support/run-entry). SUITES: no suite is in two of them. Files of servers for their user's
# programs lie in the build folder.
function(tessera_entry name)
  cmake_parse_arguments(ARG "SUITES" "SHARDS;FILTER" "COMMAND;PROPERTIES" ${ARGN})
  file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/run)
  set(run ${CMAKE_SOURCE_DIR}/tests/support/run-entry)
  set(entries ${name})
  if(ARG_SHARDS GREATER 1)
    math(EXPR last "${ARG_SHARDS} - 1")
    set(entries)
    foreach(index RANGE ${last})
      list(APPEND entries ${name}.${index})
    endforeach()
  endif()
  set(index 0)
  foreach(entry ${entries})
    set(part)
    if(ARG_SHARDS)
      set(part --shard ${index}/${ARG_SHARDS})
    endif()
    if(ARG_SUITES)
      list(APPEND part --suites)
    endif()
    if(ARG_FILTER)
      list(APPEND part "--filter=${ARG_FILTER}")
    endif()
    add_test(NAME ${entry} COMMAND ${run} ${part} ${entry} ${ARG_COMMAND})
    set(variables "TESSERA_BUILD=${CMAKE_BINARY_DIR}" "XDG_RUNTIME_DIR=${CMAKE_BINARY_DIR}/run"
      "TESSERA_NODE_MODULES=${CMAKE_BINARY_DIR}/npm/node_modules")
    set_tests_properties(${entry} PROPERTIES TIMEOUT 600 SKIP_RETURN_CODE 77 ENVIRONMENT "${variables}"
      ${ARG_PROPERTIES})
    math(EXPR index "${index} + 1")
  endforeach()
endfunction()

# tessera_test(NAME FOLDER LINK … [SHARDS n [SUITES]] [LOCK resource] [WORLD filter [WORLD_SHARDS n]]): one executable
# of all .cpp files of a folder below tests/, and entries of ctest that run it, each at most a minute of the processor.
# LOCK: what its tests share with those of other entries. WORLD: tests of run-tests --all alone (label world).
# Time-outs: tests/times.txt.
function(tessera_test name folder)
  cmake_parse_arguments(ARG "SUITES" "SHARDS;LOCK;WORLD;WORLD_SHARDS" "LINK;DEFINE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(${name} ${sources})
  tessera_unite(${name})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} tessera_test_words GTest::gtest GTest::gtest_main fmt::fmt
    tessera_flags)
  # What a test itself computes is little: half the time of compiling it is worth more.
  target_compile_options(${name} PRIVATE -O1)
  tessera_reuse_headers_for_tests(${name})
  target_compile_definitions(${name} PRIVATE TESSERA_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    TESSERA_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}" ${ARG_DEFINE})
  if(NOT ARG_SHARDS)
    set(ARG_SHARDS 1)
  endif()
  if(NOT ARG_WORLD_SHARDS)
    set(ARG_WORLD_SHARDS 1)
  endif()
  set(lock)
  if(ARG_LOCK)
    set(lock RESOURCE_LOCK ${ARG_LOCK})
  endif()
  set(others)
  set(suites)
  if(ARG_SUITES)
    set(suites SUITES)
  endif()
  if(ARG_WORLD)
    tessera_entry(${name}.world COMMAND $<TARGET_FILE:${name}> SHARDS ${ARG_WORLD_SHARDS} ${suites}
      FILTER "${ARG_WORLD}" PROPERTIES LABELS world ${lock})
    set(others FILTER "-${ARG_WORLD}")
  endif()
  tessera_entry(${name} COMMAND $<TARGET_FILE:${name}> SHARDS ${ARG_SHARDS} ${suites} ${others} PROPERTIES
    ${lock})
endfunction()
