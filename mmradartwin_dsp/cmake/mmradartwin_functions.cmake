# What the packages' CMakeLists.txt have in common; whoever finds mmradartwin_dsp has it.
#
# A package is built in two ways: by catkin as a whole, or as a part of the repository's CMakeLists.txt, which sets
# MMRADARTWIN_CORE and takes only what needs no ROS.

# Build type, language and warnings, and the folders of what is installed.
macro(mmradartwin_defaults)
  if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release)
  endif()
  set(CMAKE_CXX_STANDARD 17)
  set(CMAKE_CXX_STANDARD_REQUIRED ON)
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)  # for clang-tidy
  add_compile_options(-Wall -Wextra)
  if(MMRADARTWIN_CORE)
    include(GNUInstallDirs)
    set(CATKIN_PACKAGE_LIB_DESTINATION ${CMAKE_INSTALL_LIBDIR})
    set(CATKIN_PACKAGE_BIN_DESTINATION ${CMAKE_INSTALL_BINDIR})
    set(CATKIN_GLOBAL_BIN_DESTINATION ${CMAKE_INSTALL_BINDIR})
    set(CATKIN_PACKAGE_INCLUDE_DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${PROJECT_NAME})
    set(CATKIN_PACKAGE_SHARE_DESTINATION ${CMAKE_INSTALL_DATADIR}/${PROJECT_NAME})
  endif()
endmacro()

# mmradartwin_link_core(TARGET PACKAGE...): links the ROS-free libraries of other packages. They are targets where all is
# built as one, and files where each package is built by itself.
function(mmradartwin_link_core target)
  foreach(package IN LISTS ARGN)
    if(TARGET ${package})
      set(library ${package})
      set(includes $<TARGET_PROPERTY:${package},INTERFACE_INCLUDE_DIRECTORIES>)
    else()
      set(library ${${package}_LIBRARIES})
      list(FILTER library INCLUDE REGEX "/lib${package}\\.(so|a)$")
      set(includes ${${package}_INCLUDE_DIRS})
    endif()
    target_link_libraries(${target} PUBLIC ${library})
    target_include_directories(${target} SYSTEM PUBLIC ${includes})
  endforeach()
endfunction()

# mmradartwin_link_ros(TARGET): links all that find_package(catkin) has found, and waits for generated messages.
function(mmradartwin_link_ros target)
  target_include_directories(${target} SYSTEM PUBLIC ${catkin_INCLUDE_DIRS})
  target_link_libraries(${target} PUBLIC ${catkin_LIBRARIES})
  if(catkin_EXPORTED_TARGETS)
    add_dependencies(${target} ${catkin_EXPORTED_TARGETS})
  endif()
endfunction()

# mmradartwin_program(NAME [FOR_TESTS] SOURCES ... [LIBRARIES ...] [DEFINITIONS ...]): a program that rosrun finds by its
# name; its target is ${PROJECT_NAME}_NAME. FOR_TESTS: built with the tests and not installed.
function(mmradartwin_program name)
  cmake_parse_arguments(program "FOR_TESTS" "" "SOURCES;LIBRARIES;DEFINITIONS" ${ARGN})
  set(target ${PROJECT_NAME}_${name})
  if(program_FOR_TESTS)
    add_executable(${target} EXCLUDE_FROM_ALL ${program_SOURCES})
    add_dependencies(tests ${target})
  else()
    add_executable(${target} ${program_SOURCES})
    install(TARGETS ${target} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name})
  if(NOT MMRADARTWIN_CORE)
    set_target_properties(${target} PROPERTIES
      RUNTIME_OUTPUT_DIRECTORY ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
  target_compile_definitions(${target} PRIVATE ${program_DEFINITIONS})
  target_link_libraries(${target} PRIVATE ${program_LIBRARIES})
endfunction()

# mmradartwin_gtest(TARGET [SERIAL] SOURCES ... [LIBRARIES ...] [DEFINITIONS ...] [INCLUDES ...] [PROGRAMS ...]): a test,
# with the targets that it starts or loads as PROGRAMS. SERIAL: it keeps time, nothing may run beside it.
function(mmradartwin_gtest target)
  cmake_parse_arguments(test "SERIAL" "" "SOURCES;LIBRARIES;DEFINITIONS;INCLUDES;PROGRAMS" ${ARGN})
  if(MMRADARTWIN_CORE)
    if(NOT BUILD_TESTING)
      return()
    endif()
    find_package(GTest REQUIRED)
    add_executable(${target} ${test_SOURCES})
    target_link_libraries(${target} PRIVATE ${test_LIBRARIES} GTest::gtest_main)
    add_test(NAME ${target} COMMAND ${target})
    set_tests_properties(${target} PROPERTIES LABELS ${PROJECT_NAME} ENVIRONMENT ROS_PACKAGE_PATH=${CMAKE_SOURCE_DIR})
    set(name ${target})
  else()
    if(NOT CATKIN_ENABLE_TESTING)
      return()
    endif()
    catkin_add_gtest(${target} ${test_SOURCES})
    if(NOT TARGET ${target})
      return()
    endif()
    target_link_libraries(${target} ${test_LIBRARIES} ${GTEST_MAIN_LIBRARIES} ${GTEST_LIBRARIES} pthread)
    set(name _ctest_${PROJECT_NAME}_gtest_${target})
  endif()
  target_include_directories(${target} PRIVATE ${test_INCLUDES})
  target_compile_definitions(${target} PRIVATE ${test_DEFINITIONS})
  if(test_PROGRAMS)
    add_dependencies(${target} ${test_PROGRAMS})
  endif()
  if(test_SERIAL)
    set_tests_properties(${name} PROPERTIES RUN_SERIAL TRUE)
  endif()
endfunction()

# mmradartwin_version(VARIABLE): the version that stands beside results, with git's word where the sources are a
# checkout.
function(mmradartwin_version variable)
  file(STRINGS ${CMAKE_CURRENT_SOURCE_DIR}/package.xml line REGEX "<version>" LIMIT_COUNT 1)
  string(REGEX REPLACE ".*<version>([^<]*)</version>.*" "\\1" version "${line}")
  execute_process(COMMAND git -C ${CMAKE_CURRENT_SOURCE_DIR} describe --always --dirty --tags
    OUTPUT_VARIABLE git OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(git)
    set(version "${version} (${git})")
  endif()
  set(${variable} ${version} PARENT_SCOPE)
endfunction()

# mmradartwin_repository(VARIABLE): the folder above the package; its real path, since a workspace may link to packages
# one by one.
function(mmradartwin_repository variable)
  get_filename_component(package ${CMAKE_CURRENT_SOURCE_DIR} REALPATH)
  get_filename_component(repository ${package} DIRECTORY)
  set(${variable} ${repository} PARENT_SCOPE)
endfunction()
