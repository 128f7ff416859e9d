#include "io/xdmf.hpp"

#include <fmt/format.h>

#include <map>

#include "io/xml.hpp"

namespace talus::io {
namespace {

std::string item(const std::string& dims, const char* type, int precision, const std::string& path) {
  return fmt::format(
      "<DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\" "
      "Format=\"HDF\">results.h5:{}</DataItem>",
      dims, type, precision, xml_text(path));
}

std::string attribute(const char* name, const char* kind, const char* centre, const std::string& data) {
  return fmt::format("        <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n",
                     name, kind, centre, data);
}

}  // namespace

std::string xdmf_text(const std::vector<XdmfFrame>& frames, const XdmfTerrain& terrain) {
  std::string text = "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n";
  if (terrain.triangles > 0)
    text += fmt::format(
        "    <Grid Name=\"terrain\" GridType=\"Uniform\">\n      <Topology TopologyType=\"Triangle\" "
        "NumberOfElements=\"{}\">{}</Topology>\n"
        "      <Geometry GeometryType=\"XYZ\">{}</Geometry>\n    </Grid>\n",
        terrain.triangles,
        item(fmt::format("{} 3", terrain.triangles), "Int", 4, "/geometry/terrain/triangles"),
        item(fmt::format("{} 3", terrain.vertices), "Float", 8, "/geometry/terrain/vertices"));
  std::string blocks;
  std::map<std::string, std::string> parts;
  for (const XdmfFrame& f : frames) {
    if (f.polygons > 0)
      blocks += fmt::format(
          "      <Grid Name=\"blocks\" GridType=\"Uniform\">\n        <Time Value=\"{}\"/>\n"
          "        <Topology TopologyType=\"Mixed\" NumberOfElements=\"{}\">{}</Topology>\n"
          "        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n{}      </Grid>\n",
          f.time, f.polygons, item(fmt::format("{}", f.topology), "Int", 4, f.group + "/blocks/topology"),
          item(fmt::format("{} 3", f.points), "Float", 8, f.group + "/blocks/points"),
          attribute("block", "Scalar", "Cell",
                    item(fmt::format("{}", f.polygons), "Int", 4, f.group + "/blocks/face_block")));
    for (const auto& p : f.structures) {
      if (p.hexes == 0) continue;
      const std::string base = f.group + "/structures/" + p.name;
      std::string data;
      const std::string n3 = fmt::format("{} 3", p.nodes), e1 = fmt::format("{}", p.hexes);
      if (p.displacement)
        data += attribute("displacement", "Vector", "Node", item(n3, "Float", 4, base + "/displacement"));
      if (p.velocity)
        data += attribute("velocity", "Vector", "Node", item(n3, "Float", 4, base + "/velocity"));
      if (p.damage_tension)
        data += attribute("damage_tension", "Scalar", "Cell", item(e1, "Float", 4, base + "/damage_tension"));
      if (p.damage_compression)
        data += attribute("damage_compression", "Scalar", "Cell",
                          item(e1, "Float", 4, base + "/damage_compression"));
      if (p.stress)
        data +=
            attribute("stress_von_mises", "Scalar", "Cell", item(e1, "Float", 4, base + "/stress_von_mises"));
      if (p.crack_width)
        data += attribute("crack_width", "Scalar", "Cell", item(e1, "Float", 4, base + "/crack_width"));
      parts[p.name] += fmt::format(
          "      <Grid Name=\"{}\" GridType=\"Uniform\">\n        <Time Value=\"{}\"/>\n"
          "        <Topology TopologyType=\"Hexahedron\" NumberOfElements=\"{}\">{}</Topology>\n"
          "        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n{}      </Grid>\n",
          xml_text(p.name), f.time, p.hexes, item(fmt::format("{} 8", p.hexes), "Int", 4, base + "/hexes"),
          item(n3, "Float", 8, base + "/nodes"), data);
    }
  }
  const auto collection = [&](const std::string& name, const std::string& grids) {
    if (!grids.empty())
      text += fmt::format(
          "    <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n{}    </Grid>\n",
          xml_text(name), grids);
  };
  collection("blocks", blocks);
  for (const auto& [name, grids] : parts) collection(name, grids);
  return text + "  </Domain>\n</Xdmf>\n";
}

}  // namespace talus::io
