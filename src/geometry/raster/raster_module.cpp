// The only file that names GDAL. Built as a shared library and loaded when the first raster is read.
#include "geometry/raster/raster_module.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <gdal.h>
#include <geo_normalize.h>
#include <ogr_spatialref.h>
#include <ogr_srs_api.h>
#include <xtiffio.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

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

std::string code_of(OGRSpatialReferenceH srs) {
  const char* authority = OSRGetAuthorityName(srs, nullptr);
  const char* code = OSRGetAuthorityCode(srs, nullptr);
  return authority && code ? std::string(authority) + ":" + code : std::string();
}

/// The code of the registered system that one without a code describes, be it in the words of another program
/// (ESRI's "D_MGI"); empty if there is none.
std::string described_code(OGRSpatialReferenceH srs) {
  constexpr int good = 90;  // of 100: all numbers agree
  int count = 0;
  int* confidence = nullptr;
  OGRSpatialReferenceH* matches = OSRFindMatches(srs, nullptr, &count, &confidence);
  std::string code = count > 0 && confidence[0] >= good ? code_of(matches[0]) : "";
  OSRFreeSRSArray(matches);
  CPLFree(confidence);
  return code;
}

std::string name_of(OGRSpatialReferenceH srs) {
  if (!srs) return "";
  if (std::string code = code_of(srs); !code.empty()) return code;
  if (std::string code = described_code(srs); !code.empty()) return code;
  char* wkt = nullptr;
  std::string text;
  if (OSRExportToWkt(srs, &wkt) == OGRERR_NONE && wkt) text = wkt;
  CPLFree(wkt);
  return text;
}

struct SystemEnd {
  void operator()(OGRSpatialReferenceH srs) const { OSRDestroySpatialReference(srs); }
};
using System = std::unique_ptr<std::remove_pointer_t<OGRSpatialReferenceH>, SystemEnd>;

/// The system of this name or WKT; null for what is none. Files and addresses are not followed.
System system_named(const char* text) {
  System srs(OSRNewSpatialReference(nullptr));
  if (OGRSpatialReference::FromHandle(srs.get())->SetFromUserInput(
          text, OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS) != OGRERR_NONE)
    srs.reset();
  return srs;
}

/// The same ground at the same numbers, whatever the names.
bool agree(OGRSpatialReferenceH a, OGRSpatialReferenceH b) {
  const char* const options[] = {"CRITERION=EQUIVALENT", "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", nullptr};
  return OSRIsSameEx(a, b, options) != 0;
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
  std::string name = name_of(plan);
  OSRDestroySpatialReference(plan);
  return name;
}

/// Unit and direction of the third axis of a system that is not put together from two.
void tell_third_axis(OGRSpatialReferenceH srs, Raster* out) {
  const char* options[] = {"FORMAT=WKT2_2018", nullptr};
  char* wkt = nullptr;
  if (OSRExportToWktEx(srs, &wkt, options) == OGRERR_NONE && wkt) {
    const std::string text = wkt, mark = "LENGTHUNIT[\"";
    const auto axis = text.rfind("AXIS[");
    const auto unit = axis == std::string::npos ? axis : text.find(mark, axis);
    if (unit != std::string::npos) {
      const auto name = unit + mark.size(), end = text.find('"', name);
      out->vertical_unit = text.substr(name, end - name);
      out->vertical_metres = std::strtod(text.c_str() + end + 2, nullptr);
      out->depths = text.substr(axis, unit - axis).find("down") != std::string::npos;
    }
  }
  CPLFree(wkt);
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
  } else if (OSRGetAxesCount(srs) == 3) {
    tell_third_axis(srs, out);
  }
}

/// What the library makes nothing of: a unit in plan where the file says no more of its system (the library
/// takes metres), and the third size of a pixel.
void tell_tags(const char* path, OGRSpatialReferenceH srs, bool scaled, Raster* out) {
  const TIFFErrorHandler errors = TIFFSetErrorHandler(nullptr), warnings = TIFFSetWarningHandler(nullptr);
  TIFF* file = XTIFFOpen(path, "r");
  TIFFSetErrorHandler(errors), TIFFSetWarningHandler(warnings);
  if (!file) return;
  const bool known = srs && (OSRIsProjected(srs) || OSRIsGeographic(srs));
  if (GTIF* keys = known ? nullptr : GTIFNew(file)) {
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
  unsigned short count = 0;
  double* sizes = nullptr;
  if (!scaled && TIFFGetField(file, TIFFTAG_GEOPIXELSCALE, &count, &sizes) == 1 && count > 2 &&
      std::isfinite(sizes[2]) && sizes[2] != 0)
    out->scale_z = sizes[2];
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

/// Blocks of a sparse file that were never written hold no data; the library reads them as zeros.
void drop_unwritten(GDALRasterBandH band, Raster* out) {
  const auto status = [&](int x, int y, int columns, int rows) {
    return GDALGetDataCoverageStatus(band, x, y, columns, rows, 0, nullptr);
  };
  if ((status(0, 0, out->columns, out->rows) & GDAL_DATA_COVERAGE_STATUS_EMPTY) == 0) return;
  int width = 0, height = 0;
  GDALGetBlockSize(band, &width, &height);
  for (int y = 0; y < out->rows; y += height)
    for (int x = 0; x < out->columns; x += width) {
      const int columns = std::min(width, out->columns - x), rows = std::min(height, out->rows - y);
      if ((status(x, y, columns, rows) & GDAL_DATA_COVERAGE_STATUS_DATA) != 0) continue;
      for (int i = y; i < y + rows; ++i) {
        const auto first = out->values.begin() + static_cast<std::ptrdiff_t>(i) * out->columns + x;
        std::fill(first, first + columns, std::numeric_limits<double>::quiet_NaN());
      }
    }
}

bool is_blank(const char* text) {
  return !text || std::string(text).find_first_not_of(" \t") == std::string::npos;
}

/// Names of the values of a band, by its list of categories or its attribute table.
bool names_values(GDALRasterBandH band) {
  char** names = GDALGetRasterCategoryNames(band);
  for (int k = 0; k < CSLCount(names); ++k)
    if (!is_blank(names[k])) return true;
  GDALRasterAttributeTableH table = GDALGetDefaultRAT(band);
  for (int c = 0; table && c < GDALRATGetColumnCount(table); ++c)
    if (GDALRATGetUsageOfCol(table, c) == GFU_Name)
      for (int r = 0; r < GDALRATGetRowCount(table); ++r)
        if (!is_blank(GDALRATGetValueAsString(table, r, c))) return true;
  return false;
}

void tell_kind(GDALDatasetH data, GDALRasterBandH band, Raster* out) {
  const GDALColorInterp colour = GDALGetRasterColorInterpretation(band);
  out->palette = GDALGetRasterColorTable(band) != nullptr || colour == GCI_PaletteIndex;
  out->colours = colour >= GCI_RedBand && colour <= GCI_YCbCr_CrBand && colour != GCI_AlphaBand;
  out->classes = names_values(band);
  out->images = std::max(1, CSLCount(GDALGetMetadata(data, "SUBDATASETS")) / 2);  // a name and a text of each
  out->bands = 0;
  for (int b = 1; b <= GDALGetRasterCount(data); ++b) {
    GDALRasterBandH of = GDALGetRasterBand(data, b);
    out->bands += GDALGetRasterColorInterpretation(of) != GCI_AlphaBand;
    const std::string name = GDALGetDescription(of);
    if (b == 1) out->band_name = name;
    if (!name.empty()) out->band_names += (out->band_names.empty() ? "" : ", ") + name;
  }
}

/// The first of these items of the metadata that is given.
std::string item_of(GDALMajorObjectH of, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const char* value = GDALGetMetadataItem(of, name, nullptr); !is_blank(value)) return value;
  return {};
}

/// All texts that a file has about itself: "TIFFTAG_IMAGEDESCRIPTION=Bare earth, heights in feet".
void tell_remarks(GDALDatasetH data, GDALRasterBandH band, OGRSpatialReferenceH srs, Raster* out) {
  for (GDALMajorObjectH of : {GDALMajorObjectH(data), GDALMajorObjectH(band)})
    for (char** item = GDALGetMetadata(of, nullptr); item && *item; ++item) out->remarks.emplace_back(*item);
  out->remarks.emplace_back(GDALGetDescription(band));
  if (const char* name = srs ? OSRGetName(srs) : nullptr) out->remarks.emplace_back(name);
}

/// Units that stand among the metadata, as programs write them that do not use the fields for it.
void tell_metadata(GDALDatasetH data, GDALRasterBandH band, Raster* out) {
  if (out->band_unit.empty()) out->band_unit = item_of(band, {"units", "unit"});
  out->loose_unit = item_of(data, {"units", "unit"});
  const std::string heights =
      item_of(data, {"vertical_units", "vertical_unit", "z_units", "z_unit", "zunits", "height_units",
                     "height_unit", "elevation_units", "elevation_unit"});
  if (heights.empty() || out->vertical_metres > 0) return;
  out->vertical_unit = heights;
  out->unit_by = "its metadata";
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

/// Files in the library's memory, and the end of them.
struct InMemory {
  std::vector<std::string> names;
  ~InMemory() {
    for (const std::string& name : names) VSIUnlink(name.c_str());
  }
  /// A copy of a file; none where it cannot be read.
  void copy(const std::string& from, const std::string& to) {
    GByte* bytes = nullptr;
    vsi_l_offset size = 0;
    if (!VSIIngestFile(nullptr, from.c_str(), &bytes, &size, -1)) return;
    VSILFILE* file = VSIFileFromMemBuffer(to.c_str(), bytes, size, TRUE);
    if (file) VSIFCloseL(file), names.push_back(to);
  }
};

/// Why a file is not read: the cause that its format's reader gives, or what the library knows it for.
std::string not_read(const char* path) {
  const std::string cause = CPLGetLastErrorType() >= CE_Failure ? CPLGetLastErrorMsg() : "";
  GDALDriverH driver = GDALIdentifyDriverEx(path, GDAL_OF_RASTER, nullptr, nullptr);
  if (!driver && !cause.empty()) return cause;
  const std::string format = driver ? std::string("is of the format ") + GDALGetDriverLongName(driver)
                                    : std::string("is of no format that is known");
  if (driver && CSLFindString(const_cast<char**>(height_formats), GDALGetDriverShortName(driver)) >= 0)
    return format + ", and cannot be read" + (cause.empty() ? "" : ": " + cause);
  return format + "; ESRI ASCII grids, GeoTIFF, HGT, DTED, HFA and points in rows (XYZ) are read";
}

/// Bytes with a sign, which the library reads as if they had none.
void apply_sign(GDALRasterBandH band, Raster* out) {
  const char* type = GDALGetMetadataItem(band, "PIXELTYPE", "IMAGE_STRUCTURE");
  if (!type || std::strcmp(type, "SIGNEDBYTE") != 0) return;
  for (double& z : out->values)
    if (z > 127) z -= 256;
}

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
    copy.names.emplace_back("/vsimem/talus_grid.txt");
    bytes = *text;
    VSILFILE* file = VSIFileFromMemBuffer(copy.names.front().c_str(), reinterpret_cast<GByte*>(bytes.data()),
                                          bytes.size(), FALSE);
    if (!file) return fail(out, "cannot be held in memory");
    VSIFCloseL(file);
    for (const char* beside : {".aux.xml", ".msk"})
      copy.copy(path + std::string(beside), copy.names.front() + beside);
  }
  // The grid text driver reads as 32-bit unless told: heights in map coordinates need all their digits.
  const char* options[] = {"DATATYPE=Float64", nullptr};
  GDALDatasetH data = GDALOpenEx(text ? copy.names.front().c_str() : path, GDAL_OF_RASTER | GDAL_OF_READONLY,
                                 height_formats, options, nullptr);
  if (!data) {
    out->error = not_read(path);
    return false;
  }
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
  apply_sign(band, out);
  if (!apply_mask(band, out) || !apply_alpha(data, out)) return fail(out, "its mask cannot be read");
  drop_unwritten(band, out);
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
  out->points = std::strcmp(GDALGetDriverShortName(GDALGetDatasetDriver(data)), "XYZ") == 0;
  OGRSpatialReferenceH own = GDALGetSpatialRef(data);
  const bool beside = !out->projection.empty() && (out->grid_of_text || !own || OSRIsLocal(own));
  OGRSpatialReferenceH srs = beside ? system_of(out->projection) : nullptr;
  tell_units(beside ? srs : own, out);
  if (std::strcmp(GDALGetDriverShortName(GDALGetDatasetDriver(data)), "GTiff") == 0)
    tell_tags(path, beside ? srs : own, has_scale != 0, out);
  tell_remarks(data, band, beside ? srs : own, out);
  if (srs) OSRDestroySpatialReference(srs);
  tell_metadata(data, band, out);
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
  if (const System srs = system_named(r->crs.c_str())) GDALSetSpatialRef(data, srs.get());
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
  const System one = system_named(a), other = system_named(b);
  if (!one || !other) return -1;
  return agree(one.get(), other.get()) || name_in_plan(one.get()) == name_in_plan(other.get());
}

extern "C" __attribute__((visibility("default"))) bool talus_raster_plan_scale(const char* crs, double x,
                                                                               double y, double* along_x,
                                                                               double* along_y) {
  start();
  CPLErrorReset();
  const System map = system_named(crs);
  if (!map || !OSRIsProjected(map.get())) return false;
  const System globe(OSRCloneGeogCS(map.get()));
  OSRSetAxisMappingStrategy(map.get(), OAMS_TRADITIONAL_GIS_ORDER);
  OSRSetAxisMappingStrategy(globe.get(), OAMS_TRADITIONAL_GIS_ORDER);  // longitude, latitude [deg]
  const std::unique_ptr<void, void (*)(void*)> transformation(
      OCTNewCoordinateTransformation(map.get(), globe.get()), [](void* t) {
        if (t) OCTDestroyCoordinateTransformation(static_cast<OGRCoordinateTransformationH>(t));
      });
  constexpr double side = 100;  // in plan: far above round-off, far below what the scale changes over
  double lon[] = {x, x + side, x}, lat[] = {y, y, y + side};
  if (!transformation ||
      !OCTTransform(static_cast<OGRCoordinateTransformationH>(transformation.get()), 3, lon, lat, nullptr))
    return false;
  const double radian = std::acos(-1.0) / 180, a = OSRGetSemiMajor(globe.get(), nullptr),
               f = 1 / OSRGetInvFlattening(globe.get(), nullptr), e_sq = std::isfinite(f) ? f * (2 - f) : 0,
               w_sq = 1 - e_sq * std::pow(std::sin(lat[0] * radian), 2);
  const double east = a / std::sqrt(w_sq) * std::cos(lat[0] * radian),  // radii of curvature [m]
      north = a * (1 - e_sq) / std::pow(w_sq, 1.5);
  const auto scale = [&](int k) {
    return side / std::hypot(east * (lon[k] - lon[0]) * radian, north * (lat[k] - lat[0]) * radian);
  };
  *along_x = scale(1), *along_y = scale(2);
  return std::isfinite(*along_x) && std::isfinite(*along_y);
}

extern "C" __attribute__((visibility("default"))) bool talus_raster_tell_crs(const char* crs, Raster* out) {
  start();
  const System srs = system_named(crs);
  if (!srs) return false;
  tell_units(srs.get(), out);
  out->in_plan = OSRIsProjected(srs.get()) || OSRIsLocal(srs.get());
  return true;
}
