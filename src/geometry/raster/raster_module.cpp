// The only file that names GDAL. Built as a shared library and loaded when the first raster is read.
#include "geometry/raster/raster_module.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <gdal.h>
#include <geo_normalize.h>
#include <ogr_srs_api.h>
#include <xtiffio.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

using talus::geometry::Raster;

namespace {

/// Formats of grids of heights. No others: among GDAL's two hundred are some that name further files or
/// addresses (VRT, WMS), and some that take nearly any bytes for theirs.
const char* const height_formats[] = {"AAIGrid", "GTiff", "SRTMHGT", "DTED", "HFA", "XYZ", nullptr};
constexpr double most_nodes = 1e8;  ///< above: 2e8 triangles, tens of gigabytes

void CPL_STDCALL quiet(CPLErr, CPLErrorNum, const char*) {}

void start() {
  static const bool once = [] {
    CPLSetConfigOption("GDAL_PAM_ENABLED", "NO");  // no .aux.xml beside the user's files
    GDALAllRegister();
    CPLSetErrorHandler(quiet);  // messages are returned, not printed
    return true;
  }();
  (void)once;
}

bool fail(Raster* r, const char* what) {
  const char* detail =
      CPLGetLastErrorType() >= CE_Failure ? CPLGetLastErrorMsg() : nullptr;  // not what it merely warned of
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

/// The system of a grid of text, from what the .prj beside it holds; null where that is none.
OGRSpatialReferenceH system_of(const std::string& projection) {
  if (projection.empty()) return nullptr;
  char** lines = CSLTokenizeString2(projection.c_str(), "\r\n", 0);
  OGRSpatialReferenceH srs = OSRNewSpatialReference(nullptr);
  const bool good = OSRImportFromESRI(srs, lines) == OGRERR_NONE;
  CSLDestroy(lines);
  if (good) return srs;
  OSRDestroySpatialReference(srs);
  return nullptr;
}

/// Of a compound system the part in plan is the one that maps are compared by.
std::string name_in_plan(OGRSpatialReferenceH srs) {
  if (!srs || !OSRIsCompound(srs)) return name_of(srs);
  OGRSpatialReferenceH plan = OSRClone(srs);
  OSRStripVertical(plan);
  const std::string name = name_of(plan);
  OSRDestroySpatialReference(plan);
  return name;
}

void tell_units(OGRSpatialReferenceH srs, Raster* out) {
  out->crs = name_in_plan(srs);
  out->geographic = srs && OSRIsGeographic(srs) != 0;
  if (!srs) return;
  char* name = nullptr;
  if (!out->geographic) {
    out->metres = OSRGetLinearUnits(srs, &name);
    if (name) out->unit = name;
  }
  if (OSRIsCompound(srs) || OSRIsVertical(srs)) {
    name = nullptr;
    out->vertical_metres = OSRGetTargetLinearUnits(srs, "VERT_CS", &name);
    if (name) out->vertical_unit = name;
    OGRAxisOrientation way = OAO_Other;
    OSRGetAxis(srs, "VERT_CS", 0, &way);
    out->depths = way == OAO_Down;
  }
}

/// Where a file names a unit in plan and no more of its system than that, the library takes metres.
void tell_unit_alone(const char* path, OGRSpatialReferenceH srs, Raster* out) {
  if (srs && (OSRIsProjected(srs) || OSRIsGeographic(srs))) return;
  const TIFFErrorHandler errors = TIFFSetErrorHandler(nullptr), warnings = TIFFSetWarningHandler(nullptr);
  TIFF* file = XTIFFOpen(path, "r");
  TIFFSetErrorHandler(errors), TIFFSetWarningHandler(warnings);
  if (!file) return;
  if (GTIF* keys = GTIFNew(file)) {
    unsigned short code = 0;
    double metres = 0;
    char* name = nullptr;
    if (GTIFKeyGetSHORT(keys, ProjLinearUnitsGeoKey, &code, 0, 1) == 1 &&
        GTIFGetUOMLengthInfo(code, &name, &metres) && metres > 0) {
      out->metres = metres;
      if (name) out->unit = name;
    }
    GTIFFreeMemory(name);
    GTIFFree(keys);
  }
  XTIFFClose(file);
}

/// Where an alpha band is zero there are no data. The library takes alpha for a mask where it is of 8 or 16
/// bits alone.
bool apply_alpha(GDALDatasetH data, Raster* out) {
  std::vector<double> alpha;
  for (int b = 2; b <= GDALGetRasterCount(data); ++b) {
    GDALRasterBandH band = GDALGetRasterBand(data, b);
    if (GDALGetRasterColorInterpretation(band) != GCI_AlphaBand) continue;
    alpha.resize(out->values.size());
    if (GDALRasterIO(band, GF_Read, 0, 0, out->columns, out->rows, alpha.data(), out->columns, out->rows,
                     GDT_Float64, 0, 0) != CE_None)
      return false;
    for (std::size_t i = 0; i < alpha.size(); ++i)
      if (alpha[i] == 0) out->values[i] = std::numeric_limits<double>::quiet_NaN();
  }
  return true;
}

/// Values without data by the band's mask: NODATA or a band of masks, whatever the file has.
bool apply_mask(GDALRasterBandH band, Raster* out) {
  const int flags = GDALGetMaskFlags(band);
  if ((flags & GMF_ALL_VALID) != 0) return true;
  std::vector<unsigned char> mask(out->values.size());
  if (GDALRasterIO(GDALGetMaskBand(band), GF_Read, 0, 0, out->columns, out->rows, mask.data(), out->columns,
                   out->rows, GDT_Byte, 0, 0) != CE_None)
    return false;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] == 0) out->values[i] = std::numeric_limits<double>::quiet_NaN();
  return true;
}

void tell_kind(GDALDatasetH data, GDALRasterBandH band, Raster* out) {
  const GDALColorInterp colour = GDALGetRasterColorInterpretation(band);
  out->palette = GDALGetRasterColorTable(band) != nullptr || colour == GCI_PaletteIndex;
  out->colours = colour >= GCI_RedBand && colour <= GCI_YCbCr_CrBand && colour != GCI_AlphaBand;
  out->bands = 0;
  for (int b = 1; b <= GDALGetRasterCount(data); ++b)
    out->bands += GDALGetRasterColorInterpretation(GDALGetRasterBand(data, b)) != GCI_AlphaBand;
}

/// While it lives, what stands beside a file (.aux.xml) is read as part of it, and the unit of heights as
/// part of its coordinate system. Nothing is written beside files that are only read.
struct AllThatIsSaid {
  AllThatIsSaid() { set("YES", "YES"); }
  ~AllThatIsSaid() { set(nullptr, nullptr); }

 private:
  static void set(const char* sidecar, const char* heights) {
    CPLSetThreadLocalConfigOption("GDAL_PAM_ENABLED", sidecar);
    CPLSetThreadLocalConfigOption("GTIFF_REPORT_COMPD_CS", heights);
  }
};

/// Ends with the copy of a text in the library's memory.
struct InMemory {
  std::string name;
  ~InMemory() {
    if (!name.empty()) VSIUnlink(name.c_str());
  }
};

}  // namespace

extern "C" __attribute__((visibility("default"))) bool talus_raster_read(const char* path,
                                                                         const std::string* text,
                                                                         Raster* out) {
  start();
  const AllThatIsSaid all;
  CPLErrorReset();
  InMemory copy;
  std::string bytes;
  if (text) {
    copy.name = "/vsimem/talus_grid.txt";
    bytes = *text;
    VSILFILE* file =
        VSIFileFromMemBuffer(copy.name.c_str(), reinterpret_cast<GByte*>(bytes.data()), bytes.size(), FALSE);
    if (!file) return fail(out, "cannot be held in memory");
    VSIFCloseL(file);
  }
  // The grid text driver reads as 32-bit unless told: heights in map coordinates need all their digits.
  const char* options[] = {"DATATYPE=Float64", nullptr};
  GDALDatasetH data = GDALOpenEx(text ? copy.name.c_str() : path, GDAL_OF_RASTER | GDAL_OF_READONLY,
                                 height_formats, options, nullptr);
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
    return fail(
        out,
        ("has " + std::to_string(out->columns) + " columns and " + std::to_string(out->rows) +
         " rows: more than 1e8 heights, which no terrain of a scene needs (cut it out with gdalwarp -te)")
            .c_str());
  }
  GDALRasterBandH band = GDALGetRasterBand(data, 1);
  out->values.resize(static_cast<std::size_t>(out->columns) * out->rows);
  if (GDALRasterIO(band, GF_Read, 0, 0, out->columns, out->rows, out->values.data(), out->columns, out->rows,
                   GDT_Float64, 0, 0) != CE_None)
    return fail(out, "cannot be read to its end");
  if (GDALDataTypeIsComplex(GDALGetRasterDataType(band))) return fail(out, "holds complex numbers");
  if (!apply_mask(band, out) || !apply_alpha(data, out)) return fail(out, "its mask cannot be read");
  int has_nodata = 0;
  const double nodata = GDALGetRasterNoDataValue(band, &has_nodata);
  if (has_nodata)
    for (double& z : out->values)
      if (z == nodata) z = std::numeric_limits<double>::quiet_NaN();  // where a mask goes before it
  int has_scale = 0, has_offset = 0;
  const double scale = GDALGetRasterScale(band, &has_scale), offset = GDALGetRasterOffset(band, &has_offset);
  if (has_scale) out->scale = scale;
  if (has_offset) out->offset = offset;
  out->bytes = GDALGetRasterDataType(band) == GDT_Byte && out->scale == 1;
  if (out->scale != 1 || out->offset != 0)
    for (double& z : out->values) z = z * out->scale + out->offset;
  if (const char* unit = GDALGetRasterUnitType(band)) out->band_unit = unit;
  tell_kind(data, band, out);
  if (!out->projection.empty()) {
    OGRSpatialReferenceH srs = system_of(out->projection);
    tell_units(srs, out);
    if (srs) OSRDestroySpatialReference(srs);
  } else {
    tell_units(GDALGetSpatialRef(data), out);
    if (std::strcmp(GDALGetDriverShortName(GDALGetDatasetDriver(data)), "GTiff") == 0)
      tell_unit_alone(path, GDALGetSpatialRef(data), out);
  }
  return true;
}

extern "C" __attribute__((visibility("default"))) bool talus_raster_write(const char* path, Raster* r) {
  start();
  CPLErrorReset();
  const char* dot = std::strrchr(path, '.');
  const bool is_text = dot && std::strcmp(dot, ".asc") == 0;
  GDALDriverH memory = GDALGetDriverByName("MEM"),
              driver = GDALGetDriverByName(is_text ? "AAIGrid" : "GTiff");
  if (!memory || !driver) return fail(r, "GDAL lacks the driver");
  GDALDatasetH data = GDALCreate(memory, "", r->columns, r->rows, 1, GDT_Float64, nullptr);
  if (!data) return fail(r, "cannot be created");
  GDALSetGeoTransform(data, r->transform);
  OGRSpatialReferenceH srs = OSRNewSpatialReference(nullptr);
  if (!r->crs.empty() && OSRSetFromUserInput(srs, r->crs.c_str()) == OGRERR_NONE)
    GDALSetSpatialRef(data, srs);
  OSRDestroySpatialReference(srs);
  GDALRasterBandH band = GDALGetRasterBand(data, 1);
  const double nodata = -9999;
  GDALSetRasterNoDataValue(band, nodata);
  std::vector<double> z = r->values;
  for (double& v : z)
    if (!std::isfinite(v)) v = nodata;
  bool good = GDALRasterIO(band, GF_Write, 0, 0, r->columns, r->rows, z.data(), r->columns, r->rows,
                           GDT_Float64, 0, 0) == CE_None;
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
  if (OSRSetFromUserInput(sa, a) == OGRERR_NONE && OSRSetFromUserInput(sb, b) == OGRERR_NONE)
    same = OSRIsSame(sa, sb);
  OSRDestroySpatialReference(sa);
  OSRDestroySpatialReference(sb);
  return same;
}
