# Lets `pip install` build this package against the ROS wheels of its build environment.
# Included only under scikit-build (SKBUILD); a colcon build never comes here.

# 1. A sourced ROS installation and the wheels would be mixed: two ABIs in one library.
if(DEFINED ENV{AMENT_PREFIX_PATH} AND NOT "$ENV{AMENT_PREFIX_PATH}" STREQUAL "")
  message(FATAL_ERROR
    "A ROS installation is sourced in this shell (AMENT_PREFIX_PATH=$ENV{AMENT_PREFIX_PATH}). "
    "Open a shell without it to install from PyPI, or build with colcon instead.")
endif()

# 2. The wheels install their CMake packages below the prefix of the build environment.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
execute_process(
  COMMAND "${Python3_EXECUTABLE}" -c
    "import ament_package, pathlib; print(pathlib.Path(ament_package.__file__).resolve().parents[4])"
  OUTPUT_VARIABLE ros_wheels_prefix
  OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
list(PREPEND CMAKE_PREFIX_PATH "${ros_wheels_prefix}")
set(ENV{AMENT_PREFIX_PATH} "${ros_wheels_prefix}")

# 3. The wheels export an include folder of the machine that they were built on; CMake stops at
#    a target whose include folder does not exist.
foreach(package
    action_msgs builtin_interfaces geometry_msgs service_msgs std_msgs
    type_description_interfaces unique_identifier_msgs)
  find_package(${package} QUIET) # not all of them come along in every version of the wheels
  set(target ${package}::${package}__rosidl_generator_py)
  if(TARGET ${target})
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
  endif()
endforeach()
