# Each plant of planted_violations.cpp as an archive, compiled as shipped code is, and as a program that runs it in a slot
# of the executive. Preset rtsan also asks the compiler what it thinks of the plant.
set(dir ${CMAKE_BINARY_DIR}/tests/planted)
punctum_test(planted_violations_test planted_violations_test.cpp unit)
target_compile_definitions(planted_violations_test PRIVATE PUNCTUM_PLANTED_DIR="${dir}")
if(PUNCTUM_SANITIZE STREQUAL "realtime")
  target_compile_definitions(planted_violations_test PRIVATE PUNCTUM_PLANTED_EFFECTS)
else()
  find_program(VALGRIND valgrind REQUIRED)
  target_compile_definitions(planted_violations_test PRIVATE
    PUNCTUM_NM_PROGRAM="${CMAKE_NM}" PUNCTUM_VALGRIND="${VALGRIND}")
endif()

add_library(planted_tick OBJECT planted_tick.cpp)
target_link_libraries(planted_tick PRIVATE punctum_rt punctum_rt_setup punctum_allocation_trap)
find_package(fmt REQUIRED)
foreach(plant malloc operator_new operator_delete vector_growth string exception range_check dynamic_cast mutex
    condition_variable printf iostream log file system_call sleep page_touch unbounded_loop virtual_call function_pointer
    guarded_static thread_local exit assert thread nothing)
  add_library(planted_${plant} STATIC planted_violations.cpp)
  target_compile_definitions(planted_${plant} PRIVATE PLANT_${plant})
  target_compile_options(planted_${plant} PRIVATE -O2)
  target_include_directories(planted_${plant} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(planted_${plant} PRIVATE fmt::fmt)
  add_executable(planted_tick_${plant} $<TARGET_OBJECTS:planted_tick>)
  target_link_libraries(planted_tick_${plant} PRIVATE planted_${plant} punctum_rt punctum_rt_setup
    punctum_allocation_trap Threads::Threads)
  set_target_properties(planted_${plant} planted_tick_${plant} PROPERTIES
    ARCHIVE_OUTPUT_DIRECTORY ${dir} RUNTIME_OUTPUT_DIRECTORY ${dir})
  add_dependencies(planted_violations_test planted_tick_${plant})
  if(PUNCTUM_SANITIZE STREQUAL "realtime")
    add_custom_command(OUTPUT ${dir}/${plant}.effects
      COMMAND sh -c "mkdir -p '${dir}' && '${CMAKE_CXX_COMPILER}' -std=c++20 -I'${CMAKE_SOURCE_DIR}' -DPLANT_${plant} -fsyntax-only -Wfunction-effects '${CMAKE_CURRENT_SOURCE_DIR}/planted_violations.cpp' >'${dir}/${plant}.effects' 2>&1"
      DEPENDS planted_violations.cpp planted_violations.hpp ${CMAKE_SOURCE_DIR}/hal/realtime.hpp
      COMMENT "asking the compiler about ${plant}" VERBATIM)
    target_sources(planted_violations_test PRIVATE ${dir}/${plant}.effects)
  endif()
endforeach()

if(PUNCTUM_SANITIZE STREQUAL "realtime")
  add_executable(planted_core EXCLUDE_FROM_ALL planted_core.cpp $<TARGET_OBJECTS:punctum-core>)
  target_link_libraries(planted_core PRIVATE $<TARGET_PROPERTY:punctum-core,LINK_LIBRARIES>)
  target_link_options(planted_core PRIVATE -Wl,--wrap=_ZN7punctum2rt5Servo4tickERKNS0_8TickInfoE)
  set_target_properties(planted_core PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${dir} OUTPUT_NAME punctum-core)
endif()
