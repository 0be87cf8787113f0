# What `cmake --install` puts where. Component `programs`: bin/ (see tessera_program). Component `share`: walls, scenes
# and guides. Component `application`: the library for applications, so that find_package(Tessera) gives
# Tessera::application and the layers below it.
include(CMakePackageConfigHelpers)

set(application_layers base input math change field cores scene session wall output request codec tls net access
  application)
list(TRANSFORM application_layers PREPEND tessera_ OUTPUT_VARIABLE application_targets)
# Tessera::rays, for applications that ask what rays meet; and the layers that it needs besides.
set(ray_layers geometry freeform drawable rays)
list(APPEND application_targets tessera_geometry tessera_freeform tessera_freeform_subdivision tessera_freeform_nurbs
  tessera_freeform_nurbs_tessellation tessera_lattice tessera_drawable tessera_rays)
# What holds their code (tessera_group).
list(APPEND application_targets tessera_foundation tessera_surfaces tessera_placed tessera_protocol
  tessera_rays_kernels)
set(package_folder lib/cmake/Tessera)

install(TARGETS ${application_targets} tessera_proto EXPORT TesseraTargets
  ARCHIVE DESTINATION lib COMPONENT application)
install(EXPORT TesseraTargets NAMESPACE Tessera:: DESTINATION ${package_folder} COMPONENT application)

# Headers keep their paths from the root: #include "common/application/Application.h". Those that only a module's own
# .cpp files include stay here; they need Asio, OpenSSL or protobuf.
foreach(layer ${application_layers} ${ray_layers})
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/common/${layer} DESTINATION include/tessera/common COMPONENT application
    FILES_MATCHING PATTERN "*.h"
    PATTERN "common/codec/Parts.h" EXCLUDE PATTERN "common/codec/MemberCodec.h" EXCLUDE
    PATTERN "common/codec/RecordCodec.h" EXCLUDE PATTERN "common/codec/MessageHead.h" EXCLUDE
    PATTERN "common/codec/Unpacker.h" EXCLUDE PATTERN "common/codec/WallMessage.h" EXCLUDE
    PATTERN "common/codec/OutputMessage.h" EXCLUDE PATTERN "common/codec/TrackingMessage.h" EXCLUDE
    PATTERN "common/codec/NavigationMessage.h" EXCLUDE PATTERN "common/wall/WallNames.h" EXCLUDE
    PATTERN "common/application/Connection.h" EXCLUDE PATTERN "common/net/FrameReader.h" EXCLUDE
    PATTERN "common/net/LinkTable.h" EXCLUDE PATTERN "common/net/NetworkThread.h" EXCLUDE
    PATTERN "common/net/SealedLink.h" EXCLUDE PATTERN "common/net/Strangers.h" EXCLUDE
    PATTERN "common/net/TcpTransportImpl.h" EXCLUDE PATTERN "common/net/TransportLink.h" EXCLUDE
    PATTERN "common/tls/OpenSsl.h" EXCLUDE PATTERN "common/tls/Tickets.h" EXCLUDE
    PATTERN "common/tls/TlsContextImpl.h" EXCLUDE)
endforeach()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/TesseraConfig.cmake.in ${CMAKE_BINARY_DIR}/TesseraConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/TesseraConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/TesseraConfig.cmake ${CMAKE_BINARY_DIR}/TesseraConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT application)

# Scene files for protobuf in other languages.
install(FILES ${CMAKE_BINARY_DIR}/generated/share/scene.proto DESTINATION share/tessera COMPONENT share)

# Folders as they are, with whatever their files name, so that nothing has to be listed here; but for what makes their
# pictures.
foreach(folder walls scenes screens examples first-hour)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/deploy/${folder} DESTINATION share/tessera COMPONENT share
    USE_SOURCE_PERMISSIONS
    PATTERN "__pycache__" EXCLUDE PATTERN "make-*.py" EXCLUDE)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE ${CMAKE_SOURCE_DIR}/deploy/real-screens.md
  ${CMAKE_SOURCE_DIR}/deploy/test-picture.png ${CMAKE_SOURCE_DIR}/deploy/changes.md
  ${CMAKE_SOURCE_DIR}/deploy/security.md ${CMAKE_SOURCE_DIR}/deploy/troubleshooting.md
  ${CMAKE_SOURCE_DIR}/server/import/WRITING.md ${CMAKE_SOURCE_DIR}/server/import/FORMATS.md
  DESTINATION share/tessera COMPONENT share)
install(FILES ${CMAKE_SOURCE_DIR}/deploy/installed.md DESTINATION share/tessera COMPONENT share RENAME README.md)

# An entry in the desktop's menu: the demonstration in windows.
install(FILES ${CMAKE_SOURCE_DIR}/deploy/desktop/tessera.desktop DESTINATION share/applications COMPONENT share)
install(FILES ${CMAKE_SOURCE_DIR}/deploy/desktop/tessera.svg DESTINATION share/icons/hicolor/scalable/apps
  COMPONENT share)

# Units of systemd name the programs where they are: the prefix is known only now.
install(CODE "set(units_from \"${CMAKE_SOURCE_DIR}/deploy/units\")
set(units_at \"${CMAKE_BINARY_DIR}/units\")" COMPONENT share)
install(CODE [[
  foreach(unit tessera-server.service tessera-client@.service)
    file(READ "${units_from}/${unit}" text)
    string(REPLACE "/usr/" "${CMAKE_INSTALL_PREFIX}/" text "${text}")
    file(WRITE "${units_at}/${unit}" "${text}")
    list(APPEND units "${units_at}/${unit}")
  endforeach()
  file(INSTALL ${units} "${units_from}/server.conf" "${units_from}/client.conf"
    DESTINATION "${CMAKE_INSTALL_PREFIX}/share/tessera/units")]] COMPONENT share)

# What deploy/install builds: all that is installed.
add_custom_target(installable)
add_dependencies(installable programs ${application_targets} tessera_proto scene_schema tessera_python tessera_blender)

# For deploy/build: a name a line.
get_property(offered GLOBAL PROPERTY TESSERA_PROGRAMS)
list(JOIN offered "\n" offered)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/programs.txt CONTENT "${offered}\n")
