# Package of CMake for the C interface: find_package(unic) with unic_DIR set to this folder.
#
# It makes the target unic::unic, the shared library with the header beside this file. The library is
# searched in UNIC_LIBRARY_DIR, in ../lib, and in the build folder of this repository. With
# UNIC_STATIC set the target is the static library.
include(FindPackageHandleStandardArgs)

# A variable of its own for each kind: CMake keeps what it has found, and UNIC_STATIC may change.
if(UNIC_STATIC)
    set(_unic_found UNIC_STATIC_LIBRARY)
    set(_unic_names ${CMAKE_STATIC_LIBRARY_PREFIX}unic${CMAKE_STATIC_LIBRARY_SUFFIX})
else()
    set(_unic_found UNIC_SHARED_LIBRARY)
    set(_unic_names ${CMAKE_SHARED_LIBRARY_PREFIX}unic${CMAKE_SHARED_LIBRARY_SUFFIX})
    if(WIN32)
        # Programs link the import library, by the name that Rust gives it: MSVC's, MinGW's.
        set(_unic_names unic.dll.lib libunic.dll.a)
    endif()
endif()
find_library(${_unic_found} NAMES ${_unic_names} NO_DEFAULT_PATH HINTS
    ${UNIC_LIBRARY_DIR} ${CMAKE_CURRENT_LIST_DIR}/../lib ${CMAKE_CURRENT_LIST_DIR}/../../../target/release)
find_package_handle_standard_args(unic REQUIRED_VARS ${_unic_found})

if(unic_FOUND AND NOT TARGET unic::unic)
    add_library(unic::unic UNKNOWN IMPORTED)
    set_target_properties(unic::unic PROPERTIES
        IMPORTED_LOCATION ${${_unic_found}}
        INTERFACE_INCLUDE_DIRECTORIES ${CMAKE_CURRENT_LIST_DIR})
    if(UNIC_STATIC AND UNIX)
        find_package(Threads REQUIRED)
        target_link_libraries(unic::unic INTERFACE Threads::Threads ${CMAKE_DL_LIBS} m)
    endif()
endif()
