# What `cmake --install` and `make deb` put where: the program, its modules beside it in lib/talus, the Python package, pages and cases.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)   # tests and benchmarks are not built for it
include(GNUInstallDirs)
install(TARGETS talus RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
foreach(module talus_fem talus_mpi talus_raster)
  if(TARGET ${module})
    install(TARGETS ${module} LIBRARY DESTINATION lib/talus)
  endif()
endforeach()
if(TARGET talus_python)
  install(TARGETS talus_python LIBRARY DESTINATION lib/python3/dist-packages/talus)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/python/talus/ DESTINATION lib/python3/dist-packages/talus FILES_MATCHING PATTERN "*.py")
endif()
# Completion scripts come from the program itself; the manual page and the changelog are compressed, as Debian's
# policy asks.
install(CODE "
  foreach(shell bash zsh fish)
    execute_process(COMMAND $<TARGET_FILE:talus> --completion \${shell}
      OUTPUT_FILE ${CMAKE_BINARY_DIR}/completion.\${shell} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  execute_process(COMMAND gzip -9nc ${CMAKE_SOURCE_DIR}/docs/talus.1
    OUTPUT_FILE ${CMAKE_BINARY_DIR}/talus.1.gz COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND gzip -9nc ${CMAKE_SOURCE_DIR}/CHANGELOG.md
    OUTPUT_FILE ${CMAKE_BINARY_DIR}/CHANGELOG.md.gz COMMAND_ERROR_IS_FATAL ANY)")
install(FILES ${CMAKE_BINARY_DIR}/completion.bash DESTINATION share/bash-completion/completions RENAME talus)
install(FILES ${CMAKE_BINARY_DIR}/completion.zsh DESTINATION share/zsh/vendor-completions RENAME _talus)
install(FILES ${CMAKE_BINARY_DIR}/completion.fish DESTINATION share/fish/vendor_completions.d RENAME talus.fish)
install(FILES ${CMAKE_BINARY_DIR}/talus.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${CMAKE_BINARY_DIR}/CHANGELOG.md.gz DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${CMAKE_SOURCE_DIR}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${CMAKE_SOURCE_DIR}/cmake/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs PATTERN "talus.1" EXCLUDE PATTERN "results" EXCLUDE)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/cases/tirol-pier DESTINATION ${CMAKE_INSTALL_DOCDIR}/cases)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME talus)
set(CPACK_PACKAGE_VENDOR "The Talus authors")
set(CPACK_PACKAGE_CONTACT "The Talus authors <talus@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Rockfall on structures by coupled 3D DDA and finite elements")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Talus simulates polyhedral rock blocks that slide, topple, bounce and roll
down real terrain (three-dimensional discontinuous deformation analysis), and
the piers, decks and walls they strike (finite elements), to probabilities of
damage. Needs a processor of level x86-64-v3 (AVX2).")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(python_depends "python3")
if(TARGET talus_python)   # the extension is for one version of Python
  math(EXPR next "${TALUS_PYTHON_MINOR} + 1")
  set(python_depends "python3 (>= 3.${TALUS_PYTHON_MINOR}), python3 (<< 3.${next})")
endif()
set(CPACK_DEBIAN_PACKAGE_DEPENDS "${python_depends}, python3-numpy, python3-h5py")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-matplotlib, gmsh")
include(CPack)
