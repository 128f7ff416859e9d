# Header-only or light dependencies that many folders use. deal.II, CGAL and GDAL are found in the
# folders that own them (src/fem, src/geometry), so that nobody else can reach them by accident.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(TBB REQUIRED)
find_package(Threads REQUIRED)
find_package(nlohmann_json REQUIRED)
