# Builds the surface fabrics of configs/fabrics (the files with a key `model`) into ${surface_preset_data}.
file(GLOB configs CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/configs/fabrics/*.toml)
# By name: with the ending, "a-b.toml" would come before "a.toml".
list(TRANSFORM configs REPLACE "\\.toml$" "")
list(SORT configs)
set(entries "")
set(count 0)
foreach(stem ${configs})
  set(config ${stem}.toml)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${config})
  file(READ ${config} text)
  if(text MATCHES "(^|\n)model = \"([a-z0-9-]+)\"")
    set(model ${CMAKE_MATCH_2})
    get_filename_component(name ${config} NAME_WE)
    string(APPEND entries "    {\"${name}\", \"${model}\",\n     R\"toml(${text})toml\"},\n")
    math(EXPR count "${count} + 1")
  endif()
endforeach()
set(surface_preset_data ${CMAKE_CURRENT_BINARY_DIR}/surface_preset_data.cpp)
string(CONCAT code "#include \"render/surface/built_in_config.h\"\n\n#include <array>\n\nnamespace heddle {\n\n"
                   "static constexpr std::array<BuiltInConfig, ${count}> kConfigs = {{\n${entries}}};\n\n"
                   "std::span<const BuiltInConfig> built_in_surface_configs() { return kConfigs; }\n\n}  // namespace heddle\n")
file(CONFIGURE OUTPUT ${surface_preset_data} CONTENT "${code}" @ONLY)
