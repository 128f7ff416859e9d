# Headers that most files include, parsed once for all targets with the same flags. The mechanics (contact, dda, fem, coupling, geometry) do
# without: their machine code, and so their results, stay what their own sources say.
option(TALUS_PRECOMPILED "Precompile the headers that most files include" ON)
# Under a sanitizer most of the time goes into code, not into headers, and headers with debug symbols take hundreds of megabytes.
if(TALUS_SANITIZE OR TALUS_TSAN OR TALUS_FUZZ OR CMAKE_BUILD_TYPE STREQUAL "Debug")
  set(TALUS_PRECOMPILED OFF)
endif()

set(talus_common_headers
    <algorithm> <array> <cmath> <cstdint> <filesystem> <fstream> <functional> <limits> <map> <memory> <numbers> <optional> <random> <set> <span>
    <sstream> <string> <string_view> <utility> <vector> <fmt/format.h> <nlohmann/json.hpp> "\"core/types.hpp\"" "\"core/error.hpp\"")

# One owner for each kind of target: libraries (-fPIC) and tests (-fPIE, GoogleTest).
if(TALUS_PRECOMPILED)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled.cpp CONTENT "")   # an owner needs a source
  add_library(talus_precompiled OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
  target_include_directories(talus_precompiled PRIVATE ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(talus_precompiled PRIVATE Eigen3::Eigen fmt::fmt nlohmann_json::nlohmann_json)
  target_precompile_headers(talus_precompiled PRIVATE ${talus_common_headers})
endif()

# talus_precompiled(TARGET): the libraries' headers.
function(talus_precompiled target)
  if(TALUS_PRECOMPILED)
    target_precompile_headers(${target} REUSE_FROM talus_precompiled)
  endif()
endfunction()
