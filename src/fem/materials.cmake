# Material laws, reinforcement and section checks: plain C++, no deal.II. Included by the CMakeLists.txt of this folder, whose own
# glob leaves material_*.cpp and rebar_*.cpp out.
file(GLOB talus_material_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/materials/material_*.cpp ${CMAKE_CURRENT_LIST_DIR}/rebar/rebar_*.cpp)
if(NOT TARGET talus_materials)
  add_library(talus_materials STATIC ${talus_material_sources})
  target_include_directories(talus_materials PUBLIC ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(talus_materials PUBLIC talus_core)
  # The laws run in every point of every sub-step.
  target_compile_options(talus_materials PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O3>)
  # Chosen at run time (core/processor.hpp).
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/materials/material_damage_avx512.cpp PROPERTIES COMPILE_OPTIONS "-march=x86-64-v4;-mprefer-vector-width=512")
endif()
