# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` lays down besides the commands and their pages, how it is taken back, and the Debian package.
include(CMakePackageConfigHelpers)

install(TARGETS shared EXPORT bsdfrbf)
install(FILES libbsdfrbf/bsdfrbf.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)

# To patch a Radiance of one's own and build it with the installed library: README.md, "Your own Radiance".
file(GLOB PATCH_FILES CONFIGURE_DEPENDS radiance-patch/*.c radiance-patch/*.h)
list(FILTER PATCH_FILES EXCLUDE REGEX "/loads\\.c$")
set(PATCH_FOLDER ${CMAKE_INSTALL_DATADIR}/bsdfrbf/radiance-patch)
install(FILES ${PATCH_FILES} radiance-patch/CMakeLists.txt libbsdfrbf/bsdfrbf.h DESTINATION ${PATCH_FOLDER})
install(PROGRAMS radiance-patch/patch DESTINATION ${PATCH_FOLDER})

# for pyproject.toml: beside the Python module
if(SKBUILD)
	install(FILES $<TARGET_FILE:shared> DESTINATION bsdfrbf RENAME $<TARGET_SONAME_FILE_NAME:shared> COMPONENT python)
endif()

# find_package(bsdfrbf), target bsdfrbf::bsdfrbf
set(PACKAGE_FOLDER ${CMAKE_INSTALL_LIBDIR}/cmake/bsdfrbf)
set_target_properties(shared PROPERTIES EXPORT_NAME bsdfrbf)
install(EXPORT bsdfrbf NAMESPACE bsdfrbf:: FILE bsdfrbf-config.cmake DESTINATION ${PACKAGE_FOLDER})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/bsdfrbf-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/bsdfrbf-config-version.cmake DESTINATION ${PACKAGE_FOLDER})

# pkg-config, relative to its own place: --prefix and packages move everything after this file is made
set(PC_FOLDER ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}" OR IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
	set(PC_PREFIX ${CMAKE_INSTALL_PREFIX})
	set(PC_LIBDIR ${CMAKE_INSTALL_FULL_LIBDIR})
	set(PC_INCLUDEDIR ${CMAKE_INSTALL_FULL_INCLUDEDIR})
else()
	string(REGEX REPLACE "[^/]+" ".." PC_PREFIX "${PC_FOLDER}")
	set(PC_PREFIX "\${pcfiledir}/${PC_PREFIX}")
	set(PC_LIBDIR "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
	set(PC_INCLUDEDIR "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(cmake/bsdfrbf.pc.in bsdfrbf.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/bsdfrbf.pc DESTINATION ${PC_FOLDER})

add_custom_target(uninstall COMMAND ${CMAKE_COMMAND} -DMANIFEST=${CMAKE_BINARY_DIR}/install_manifest.txt
	-P ${CMAKE_CURRENT_SOURCE_DIR}/cmake/uninstall.cmake)

# `cpack -G DEB` in the build folder. Needs the Debian packages dpkg-dev and file.
set(CPACK_PACKAGE_CONTACT "libbsdfrbf authors <bsdfrbf@localhost>")
set(CPACK_PACKAGE_VENDOR "libbsdfrbf")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_RESOURCE_FILE_LICENSE ${CMAKE_CURRENT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Fits goniophotometer measurements with Gaussian lobes and records an
interpolant that can be evaluated and sampled: library, header and commands.")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_GENERATOR DEB)
include(CPack)
