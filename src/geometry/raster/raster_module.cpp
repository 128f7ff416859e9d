// The only file that names GDAL. Built as a shared library and loaded when the first raster is read.
#include "geometry/raster/raster_module.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal.h>
#include <ogr_srs_api.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

using talus::geometry::Raster;

namespace {

/// Formats of grids of heights. No others: among GDAL's two hundred are some that name further files or addresses (VRT, WMS), and some that take nearly any bytes for theirs.
const char* const height_formats[] = {"AAIGrid", "GTiff", "SRTMHGT", "DTED", "HFA", "XYZ", nullptr};
constexpr double most_nodes = 1e8;   ///< above: 2e8 triangles, tens of gigabytes

void CPL_STDCALL quiet(CPLErr, CPLErrorNum, const char*) {}

void start() {
  static const bool once = [] {
    CPLSetConfigOption("GDAL_PAM_ENABLED", "NO");  // no .aux.xml beside the user's files
    GDALAllRegister();
    CPLSetErrorHandler(quiet);                     // messages are returned, not printed
    return true;
  }();
  (void)once;
}

bool fail(Raster* r, const char* what) {
  const char* detail = CPLGetLastErrorType() >= CE_Failure ? CPLGetLastErrorMsg() : nullptr;   // not what it merely warned of
  r->error = detail && *detail ? std::string(what) + ": " + detail : what;
  return false;
}

std::string name_of(OGRSpatialReferenceH srs) {
  if (!srs) return "";
  const char* authority = OSRGetAuthorityName(srs, nullptr);
  const char* code = OSRGetAuthorityCode(srs, nullptr);
  if (authority && code) return std::string(authority) + ":" + code;
  char* wkt = nullptr;
  std::string text;
  if (OSRExportToWkt(srs, &wkt) == OGRERR_NONE && wkt) text = wkt;
  CPLFree(wkt);
  return text;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) bool talus_raster_read(const char* path, Raster* out) {
  start();
  CPLErrorReset();
  // The grid text driver reads as 32-bit unless told: heights in map coordinates need all their digits.
  const char* options[] = {"DATATYPE=Float64", nullptr};
  GDALDatasetH data = GDALOpenEx(path, GDAL_OF_RASTER | GDAL_OF_READONLY, height_formats, options, nullptr);
  if (!data) return fail(out, "not a raster that GDAL reads");
  const std::unique_ptr<void, void (*)(void*)> close(data, [](void* d) { GDALClose(d); });
  out->columns = GDALGetRasterXSize(data);
  out->rows = GDALGetRasterYSize(data);
  if (GDALGetGeoTransform(data, out->transform) != CE_None) {
    out->placed = false;
    return false;
  }
  if (GDALGetRasterCount(data) < 1) return fail(out, "has no band");
  if (const double nodes = static_cast<double>(out->columns) * out->rows; nodes > most_nodes) {
    CPLErrorReset();
    return fail(out, ("has " + std::to_string(out->columns) + " columns and " + std::to_string(out->rows) +
                      " rows: more than 1e8 heights, which no terrain of a scene needs (cut it out with gdalwarp -te)").c_str());
  }
  GDALRasterBandH band = GDALGetRasterBand(data, 1);
  out->values.resize(static_cast<std::size_t>(out->columns) * out->rows);
  if (GDALRasterIO(band, GF_Read, 0, 0, out->columns, out->rows, out->values.data(), out->columns, out->rows, GDT_Float64, 0, 0) != CE_None)
    return fail(out, "cannot be read to its end");
  int has_nodata = 0;
  const double nodata = GDALGetRasterNoDataValue(band, &has_nodata);
  if (has_nodata)
    for (double& z : out->values)
      if (z == nodata || (std::isnan(nodata) && std::isnan(z))) z = std::numeric_limits<double>::quiet_NaN();
  out->crs = name_of(GDALGetSpatialRef(data));
  out->geographic = GDALGetSpatialRef(data) && OSRIsGeographic(GDALGetSpatialRef(data)) != 0;
  return true;
}

extern "C" __attribute__((visibility("default"))) bool talus_raster_write(const char* path, Raster* r) {
  start();
  CPLErrorReset();
  const char* dot = std::strrchr(path, '.');
  const bool is_text = dot && std::strcmp(dot, ".asc") == 0;
  GDALDriverH memory = GDALGetDriverByName("MEM"), driver = GDALGetDriverByName(is_text ? "AAIGrid" : "GTiff");
  if (!memory || !driver) return fail(r, "GDAL lacks the driver");
  GDALDatasetH data = GDALCreate(memory, "", r->columns, r->rows, 1, GDT_Float64, nullptr);
  if (!data) return fail(r, "cannot be created");
  GDALSetGeoTransform(data, r->transform);
  OGRSpatialReferenceH srs = OSRNewSpatialReference(nullptr);
  if (!r->crs.empty() && OSRSetFromUserInput(srs, r->crs.c_str()) == OGRERR_NONE) GDALSetSpatialRef(data, srs);
  OSRDestroySpatialReference(srs);
  GDALRasterBandH band = GDALGetRasterBand(data, 1);
  const double nodata = -9999;
  GDALSetRasterNoDataValue(band, nodata);
  std::vector<double> z = r->values;
  for (double& v : z)
    if (!std::isfinite(v)) v = nodata;
  bool good = GDALRasterIO(band, GF_Write, 0, 0, r->columns, r->rows, z.data(), r->columns, r->rows, GDT_Float64, 0, 0) == CE_None;
  if (good) {
    GDALDatasetH copy = GDALCreateCopy(driver, path, data, FALSE, nullptr, nullptr, nullptr);
    good = copy != nullptr;
    if (copy) GDALClose(copy);
  }
  GDALClose(data);
  return good ? true : fail(r, "cannot be written");
}

extern "C" __attribute__((visibility("default"))) int talus_raster_same_crs(const char* a, const char* b) {
  start();
  OGRSpatialReferenceH sa = OSRNewSpatialReference(nullptr), sb = OSRNewSpatialReference(nullptr);
  int same = -1;
  if (OSRSetFromUserInput(sa, a) == OGRERR_NONE && OSRSetFromUserInput(sb, b) == OGRERR_NONE) same = OSRIsSame(sa, sb);
  OSRDestroySpatialReference(sa);
  OSRDestroySpatialReference(sb);
  return same;
}
