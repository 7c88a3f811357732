# Read by cpack, which knows the version: the packages fit together in one version only.
set(CPACK_DEBIAN_VISION_PACKAGE_DEPENDS "punctum (= ${CPACK_DEBIAN_PACKAGE_VERSION})")
set(CPACK_DEBIAN_CONSOLE_PACKAGE_DEPENDS "punctum (= ${CPACK_DEBIAN_PACKAGE_VERSION})")
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "punctum (= ${CPACK_DEBIAN_PACKAGE_VERSION})")
