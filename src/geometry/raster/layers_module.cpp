// GeoPackages and shapefiles, in the module that links GDAL.
#include "geometry/raster/layers_module.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal.h>
#include <ogr_api.h>
#include <ogr_srs_api.h>

#include <cmath>
#include <memory>
#include <string>

using talus::geometry::Layer;

namespace {

void CPL_STDCALL quiet(CPLErr, CPLErrorNum, const char*) {}

bool fail(std::string* error, const char* what) {
  const char* detail = CPLGetLastErrorType() >= CE_Failure ? CPLGetLastErrorMsg() : nullptr;
  *error = detail && *detail ? std::string(what) + ": " + detail : what;
  return false;
}

OGRGeometryH geometry_of(const Layer& layer, const Layer::Feature& feature) {
  if (!layer.lines) {
    OGRGeometryH point = OGR_G_CreateGeometry(wkbPoint25D);
    const auto& p = feature.parts.front().front();
    OGR_G_SetPoint(point, 0, p[0], p[1], p[2]);
    return point;
  }
  OGRGeometryH all = OGR_G_CreateGeometry(wkbMultiLineString25D);
  for (const auto& part : feature.parts) {
    OGRGeometryH line = OGR_G_CreateGeometry(wkbLineString25D);
    for (const auto& p : part) OGR_G_AddPoint(line, p[0], p[1], p[2]);
    OGR_G_AddGeometryDirectly(all, line);
  }
  return all;
}

bool write(GDALDatasetH data, OGRSpatialReferenceH srs, const Layer& layer) {
  OGRLayerH out = GDALDatasetCreateLayer(data, layer.name.c_str(), srs,
                                         layer.lines ? wkbMultiLineString25D : wkbPoint25D, nullptr);
  if (!out) return false;
  const auto field = [&](const std::string& name, OGRFieldType type) {
    OGRFieldDefnH definition = OGR_Fld_Create(name.c_str(), type);
    const bool good = OGR_L_CreateField(out, definition, TRUE) == OGRERR_NONE;
    OGR_Fld_Destroy(definition);
    return good;
  };
  for (const std::string& name : layer.number_fields)
    if (!field(name, OFTReal)) return false;
  for (const std::string& name : layer.text_fields)
    if (!field(name, OFTString)) return false;
  if (OGR_L_StartTransaction(out) != OGRERR_NONE) return false;
  for (const Layer::Feature& feature : layer.features) {
    const std::unique_ptr<void, void (*)(void*)> f(
        OGR_F_Create(OGR_L_GetLayerDefn(out)), [](void* p) { OGR_F_Destroy(static_cast<OGRFeatureH>(p)); });
    const auto h = static_cast<OGRFeatureH>(f.get());
    for (std::size_t k = 0; k < feature.numbers.size(); ++k)
      if (std::isfinite(feature.numbers[k])) OGR_F_SetFieldDouble(h, static_cast<int>(k), feature.numbers[k]);
    for (std::size_t k = 0; k < feature.texts.size(); ++k)
      OGR_F_SetFieldString(h, static_cast<int>(layer.number_fields.size() + k), feature.texts[k].c_str());
    OGR_F_SetGeometryDirectly(h, geometry_of(layer, feature));
    if (OGR_L_CreateFeature(out, h) != OGRERR_NONE) return false;
  }
  return OGR_L_CommitTransaction(out) == OGRERR_NONE;
}

std::string taken(char* text) {
  std::string copy = text ? text : "";
  CPLFree(text);
  return copy;
}

/// A coordinate system by its code where it has one, else in WKT; empty where the layer names none.
std::string system_of(OGRLayerH layer) {
  OGRSpatialReferenceH srs = OGR_L_GetSpatialRef(layer);
  if (!srs) return {};
  const char *authority = OSRGetAuthorityName(srs, nullptr), *code = OSRGetAuthorityCode(srs, nullptr);
  if (authority && code) return std::string(authority) + ":" + code;
  char* wkt = nullptr;
  OSRExportToWkt(srs, &wkt);
  return taken(wkt);
}

/// A text within quotation marks of JSON.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

/// The features of a layer that have a geometry, separated by commas.
std::string features_of(OGRLayerH layer) {
  const std::string system = system_of(layer);
  const std::string head =
      R"({"type": "Feature", )" +
      (system.empty() ? "" : R"("crs": {"type": "name", "properties": {"name": )" + quoted(system) + "}}, ") +
      R"("geometry": )";
  std::string all;
  OGR_L_ResetReading(layer);
  while (OGRFeatureH feature = OGR_L_GetNextFeature(layer)) {
    if (OGRGeometryH geometry = OGR_F_GetGeometryRef(feature)) {
      OGRGeometryH straight = OGR_G_GetLinearGeometry(geometry, 0, nullptr);  // default step: 4 degrees
      if (const std::string text = taken(OGR_G_ExportToJson(straight)); !text.empty())
        all.append(all.empty() ? "" : ",\n").append(head).append(text).append("}");
      OGR_G_DestroyGeometry(straight);
    }
    OGR_F_Destroy(feature);
  }
  return all;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) bool talus_layers_write(const char* path, const char* crs,
                                                                          const Layer* layers, int count,
                                                                          std::string* error) {
  GDALAllRegister();
  CPLSetErrorHandler(quiet);
  CPLErrorReset();
  GDALDriverH driver = GDALGetDriverByName("GPKG");
  if (!driver) return fail(error, "GDAL lacks the driver for GeoPackage");
  GDALDatasetH data = GDALCreate(driver, path, 0, 0, 0, GDT_Unknown, nullptr);
  if (!data) return fail(error, "cannot be created");
  OGRSpatialReferenceH srs = OSRNewSpatialReference(nullptr);
  const bool known = *crs != '\0' && OSRSetFromUserInput(srs, crs) == OGRERR_NONE;
  bool good = true;
  for (int k = 0; k < count && good; ++k) good = write(data, known ? srs : nullptr, layers[k]);
  if (!good) fail(error, "cannot be written");
  OSRDestroySpatialReference(srs);
  GDALClose(data);
  return good;
}

extern "C" __attribute__((visibility("default"))) bool talus_layers_read(const char* path,
                                                                         std::string* geojson,
                                                                         std::string* error) {
  GDALAllRegister();
  CPLSetErrorHandler(quiet);
  CPLErrorReset();
  const char* const formats[] = {"ESRI Shapefile", "GPKG", nullptr};
  const std::unique_ptr<void, void (*)(void*)> data(
      GDALOpenEx(path, GDAL_OF_VECTOR | GDAL_OF_READONLY, formats, nullptr, nullptr),
      [](void* d) { GDALClose(d); });
  if (!data) return fail(error, "cannot be read");
  std::string features, names;
  int filled = 0;
  for (int k = 0; k < GDALDatasetGetLayerCount(data.get()); ++k) {
    OGRLayerH layer = GDALDatasetGetLayer(data.get(), k);
    std::string of_layer = features_of(layer);
    if (CPLGetLastErrorType() >= CE_Failure) return fail(error, "cannot be read to its end");
    if (of_layer.empty()) continue;
    ++filled;
    names += (names.empty() ? "" : ", ") + std::string(OGR_L_GetName(layer));
    features = std::move(of_layer);
  }
  CPLErrorReset();
  if (filled > 1) return fail(error, ("holds several layers: " + names).c_str());
  *geojson = R"({"type": "FeatureCollection", "features": [)" + features + "]}";
  return true;
}
