// A hundred broken scenes, each the full scene with one thing wrong, and what must be said about it.
#include <iterator>

#include "fixture.hpp"

namespace talus::scene {
namespace {

struct Broken {
  const char* from;
  const char* to;
  const char* key;      // of the problem
  const char* message;  // part of its rule and remedy
};

const Broken list[] = {
    // the top
    {"schema = 1", "schema = 2", "schema", "must be 1"},
    {"schema = 1", "schema = \"1\"", "schema", "must be a whole number, not a text"},
    {"schema = 1", "schema = 1.0", "schema", "must be a whole number, not a decimal number"},
    {"schema = 1\n", "", "schema", "is missing"},
    {"title = \"Boulder against pier P2\"", "titel = \"x\"", "titel", "unknown key; did you mean \"title\"?"},
    {"title = \"Boulder against pier P2\"", "title = 5", "title", "must be a text, not a whole number"},
    {"title = \"Boulder against pier P2\"", "duration = 5", "duration",
     "\"duration\" belongs in [simulation]"},
    {"[output]", "[outputs]", "outputs", "did you mean \"output\"?"},
    {"[output]", "[ensemble]\nmember = 5\n[output]", "ensemble.member", "unknown key"},
    {"[output]", "[[line]]\nname = \"net\"\n[output]", "line.net", "needs points or a file"},
    {"[output]", "[temperature]\n[output]", "temperature", "the keys here are schema, title"},
    // decimal commas: the file is read on
    {"height = \"12 m\"", "height = 8,5", "height", "has a decimal comma; write 8.5"},
    {"height = \"12 m\"", "height = \"8,5 m\"", "structure.P2.height",
     "has a decimal comma: write \"8.5 m\""},
    {"position = [0.0, 0.0, 120.0]", "position = [-1,6, 0, 2,5]", "block.B1.position",
     "these are 5 numbers: commas separate them; decimals have a point"},
    // weights in place of masses
    {"density = \"2.5 t/m^3\"", "density = \"26 kN/m^3\"", "material.rock.density",
     "this one is a weight, of 2651 kg/m^3"},
    // what other programs and norms call it
    {"f_cm = \"48 MPa\"", "f_ck = \"35 MPa\"", "material.C40.f_ck",
     "f_cm = f_ck + 8 MPa: write f_cm = \"43 MPa\""},
    {"rebar = \"bars.csv\"",
     "rebar = [{ kind = \"longitudinal\", bars = 4, diameter = 0.02, cover = 0.05, grade = \"B550B\" }]",
     "structure.P2.rebar.0.grade", "yield = \"550 MPa\""},
    {"accuracy = 1e-3", "accuracy = 1e-3\ndamping_ratio = 0.02", "simulation.damping_ratio",
     "\"damping_ratio\" belongs in [interface] or [structure]"},
    {"height = \"12 m\"", "height = \"12 m\"\nhight = 3", "structure.P2.hight",
     "did you mean \"height\", which is there already?"},
    {"title = \"Boulder against pier P2\"", "title = \"Boulder against pier P2", "",
     "the quote that ends the text is missing in this line"},
    {"[output]", "[simulation]\nduration = 3\n[output]", "", "each key and each [table] stands once"},
    {"name = \"rock\"", "name = \"rock \"", "material.rock .name", "must not begin or end with a blank"},
    // simulation
    {"accuracy = 1e-3", "step = 1e-10", "simulation.step", "must not be shorter than min_step, 1e-09 s"},
    {"accuracy = 1e-3", "min_step = 31", "simulation.min_step", "must not be longer than the duration, 30 s"},
    {"friction = 0.5",
     "friction = 0.5\ncontact_law = { kind = \"table\", points = [[0, 0], [0.1, 0], [0.2, 0]] }",
     "interface.rock/*.contact_law.points", "the force must grow"},
    {"spacing = \"3.84 m\"", "spacing = \"3.84 m\"\nspacing_deviation = 0.5",
     "rock_mass.joint_set.J3.spacing_deviation", "has no effect with spacing_distribution = \"constant\""},
    {"duration = \"30 s\"", "duration = \"30 m\"", "simulation.duration",
     "must be a time in s, e.g. 1e-3 or \"1 ms\": this one is in m"},
    {"duration = \"30 s\"", "duration = \"30 sec\"", "simulation.duration", "unknown unit \"sec\""},
    {"duration = \"30 s\"", "duration = \"30\"", "simulation.duration", "the unit is missing"},
    {"duration = \"30 s\"", "duration = 30°", "", "values with a unit, stand in quotes"},
    {"duration = \"30 s\"", "duration = 0", "simulation.duration", "must be > 0 s"},
    {"duration = \"30 s\"", "duration = -1", "simulation.duration", "must be > 0 s"},
    {"duration = \"30 s\"", "duration = nan", "simulation.duration", "must be finite"},
    {"duration = \"30 s\"", "duration = inf", "simulation.duration", "must be finite"},
    {"duration = \"30 s\"", "duration = true", "simulation.duration", "must be a time in s"},
    {"duration = \"30 s\"", "duration = 1979-05-27", "simulation.duration", "must be a time in s"},
    {"duration = \"30 s\"", "duraton = \"30 s\"", "simulation.duraton", "did you mean \"duration\"?"},
    {"duration = \"30 s\"", "until = \"sleep\"", "simulation.until", "must be one of duration, rest"},
    {"accuracy = 1e-3", "accuracy = 1e-3\nstep = \"1 ms\"", "simulation.step",
     "a fixed step and accuracy exclude each other"},
    {"accuracy = 1e-3", "accuracy = 2", "simulation.accuracy", "must be at least 1e-12 and at most 0.5"},
    {"accuracy = 1e-3", "step = \"60 s\"", "simulation.step", "must not be longer than the duration"},
    {"accuracy = 1e-3", "method = \"dda-1988\"", "simulation.step", "works with a fixed step"},
    {"accuracy = 1e-3", "accuracy = 1e-3\nmethod = \"dda-1988\"", "simulation.accuracy",
     "has no error control"},
    {"accuracy = 1e-3", "method = \"dda1988\"", "simulation.method", "did you mean \"dda-1988\"?"},
    {"accuracy = 1e-3", "until = \"rest\"\ngravity = [0, 0, 0]", "simulation.until", "without gravity"},
    {"accuracy = 1e-3", "gravity = [0, -9.81]", "simulation.gravity",
     "must be [x, y, z], each an acceleration in m/s^2"},
    {"accuracy = 1e-3", "gravity = -9.81", "simulation.gravity", "must be [x, y, z]"},
    {"accuracy = 1e-3", "gravity = [0, 0, \"9.81 m/s\"]", "simulation.gravity", "this one is in m/s"},
    {"accuracy = 1e-3", "threads = -1", "simulation.threads", "must be at least 0 and at most 4096"},
    {"accuracy = 1e-3", "sleeping = 1", "simulation.sleeping", "must be true or false, not a whole number"},
    {"accuracy = 1e-3", "initial_state = \"gone.h5\"", "simulation.initial_state", "there is no file"},
    // site and planes
    {"terrain = \"slope.stl\"", "terrain = \"slop.stl\"", "site.terrain", "there is no file"},
    {"terrain = \"slope.stl\"", "terrain = \"folder\"", "site.terrain", "is not a file"},
    {"terrain = \"slope.stl\"", "terrain = \"\"", "site.terrain", "must not be empty"},
    {"terrain = \"slope.stl\"\n", "", "site.terrain", "is missing"},
    {"terrain = \"slope.stl\"", "terrain = \"slope.stl\"\ndecimation = \"-1 m\"", "site.decimation",
     "must be >= 0 m"},
    {"terrain = \"slope.stl\"", "terrain = \"slope.stl\"\ncrop = { min = [5, 5], max = [0, 9] }",
     "site.crop.max", "must be greater than min"},
    {"terrain = \"slope.stl\"", "terrain = \"slope.stl\"\ncrop = { min = [5, 5] }", "site.crop.max",
     "is missing"},
    {"terrain = \"slope.stl\"",
     "terrain = \"slope.stl\"\n[[site.face]]\ndip = \"30 deg\"\nlength = 5\n[site.crop]\nmin = [0, 0]\nmax = "
     "[1, 1]",
     "site.face", "the terrain is given by terrain already"},
    {"terrain = \"slope.stl\"", "face = [{ dip = \"30 deg\", length = 5 }]\nwidth = 9", "site.dip_direction",
     "is missing"},
    {"terrain = \"slope.stl\"", "terrain = \"slope.stl\"\nwidth = 9", "site.width",
     "only a slope of [[site.face]] has it"},
    {"terrain = \"slope.stl\"",
     "terrain = \"slope.stl\"\narea = [{ raster = \"slope.stl\", material = \"slope\" }]",
     "site.area.0.value", "the class of ground meant"},
    {"terrain = \"slope.stl\"", "terrain = \"slope.stl\"\narea = [{ material = \"slope\" }]",
     "site.area.0.polygon", "or raster and value"},
    {"material = \"slope\"\n\n[[plane]]", "material = \"slop\"\n\n[[plane]]", "site.material",
     "there is no such material"},
    {"normal = [0.0, 0.0, 2.0]", "normal = [0.0, 0.0, 0.0]", "plane.0.normal", "must not be zero"},
    {"normal = [0.0, 0.0, 2.0]", "normal = [0.0, 0.0, 2.0]\ndip = \"3 deg\"", "plane.0.normal",
     "the plane is given twice"},
    {"normal = [0.0, 0.0, 2.0]\n", "", "plane.0.normal", "is missing: or dip_direction and dip"},
    {"normal = [0.0, 0.0, 2.0]", "dip_direction = \"90 deg\"\ndip = \"95 deg\"", "plane.0.dip",
     "must be at least 0 deg and at most 90 deg"},
    {"normal = [0.0, 0.0, 2.0]", "dip_direction = \"90 deg\"\ndip = 29", "plane.0.dip",
     "a bare number is in radians"},
    {"rebar = \"bars.csv\"",
     "rebar = [{ kind = \"stirrups\", diameter = \"12 mm\", cover = \"40 mm\", spacing = \"150 m\" }]",
     "structure.P2.rebar.0.spacing", "is longer than the member (12 m)"},
    {"height = \"12 m\"", "height = 12000", "structure.P2.height",
     "no column is that high: 12000 m; a bare number is in m: did you mean \"12000 mm\"?"},
    {"height = \"12 m\"", "height = \"12 km\"", "structure.P2.height",
     "no column is that high: 12000 m; check the number and its unit"},
    {"section = [2.0, 2.0]", "section = [1200, 400]", "structure.P2.section",
     "no column is that thick: 1200 m; a bare number is in m: did you mean \"1200 mm\"?"},
    {"at = [20.0, 0.0, 12.0]", "", "structure.P2.probe.top.at",
     "or offset, from the structure's base or position"},
    {"at = [20.0, 0.0, 12.0]", "at = [20.0, 0.0, 12.0]\noffset = [0, 0, 12]", "structure.P2.probe.top.offset",
     "at gives the point already"},
    // materials
    {"density = \"2.5 t/m^3\"", "density = -2500", "material.rock.density", "must be > 0 kg/m^3"},
    {"density = \"2.5 t/m^3\"", "density = \"2.5 kg\"", "material.rock.density",
     "must be a density in kg/m^3, e.g. 2500 or \"2.5 t/m^3\": this one is in kg"},
    {"density = \"2.5 t/m^3\"\n", "", "block.B1.material", "has no density"},
    {"young = \"3 GPa\"", "young = 0", "material.rock.young", "must be > 0 Pa"},
    {"poisson = 0.3", "poisson = 0.5", "material.rock.poisson", "must be above -1 and below 0.5"},
    {"name = \"C40\"", "name = \"rock\"", "material.rock.name", "the name is taken already"},
    {"name = \"C40\"", "name = \"a/b\"", "material.a/b.name", "without slash"},
    {"f_cm = \"48 MPa\"", "f_cm = 48", "material.C40.f_cm",
     "must be at least 8e+06 Pa and at most 1.4e+08 Pa"},
    {"f_cm = \"48 MPa\"", "density = 2450", "structure.P2.material", "has neither f_cm nor young"},
    {"f_cm = \"48 MPa\"", "density = 2450\nyoung = \"30 GPa\"", "structure.P2.damage", "needs a concrete"},
    {"[[material]]\nname = \"C40\"", "[material.C40]", "material.rock.C40", "unknown key"},
    // interfaces
    {"friction = \"28 deg\"", "friction = \"28 degree\"", "interface.rock/slope.friction",
     "unknown unit \"degree\""},
    {"friction = \"28 deg\"", "friction = \"90 deg\"", "interface.rock/slope.friction", "below 90 deg"},
    {"friction = \"28 deg\"", "friction = -0.1", "interface.rock/slope.friction",
     "must be a coefficient >= 0 or an angle"},
    {"friction = \"28 deg\"", "friction = \"28 m\"", "interface.rock/slope.friction", "this one is in m"},
    {"friction = \"28 deg\"\n", "", "interface.rock/slope.friction", "is missing"},
    {"between = [\"rock\", \"slope\"]", "between = [\"rock\"]", "interface.0.between",
     "must name two materials"},
    {"between = [\"rock\", \"slope\"]", "between = [\"rokc\", \"slope\"]", "interface.rokc/slope.between",
     "did you mean \"rock\"?"},
    {"between = [\"rock\", \"*\"]", "between = [\"slope\", \"rock\"]", "interface.slope/rock.between",
     "there is an entry for this pair already, and it says something else"},
    {"between = [\"*\", \"*\"]", "between = [\"C40\", \"*\"]", "interface.rock/*.between",
     "two entries with \"*\" cover \"rock\" and \"C40\" and differ"},
    {"normal_stiffness = \"30 GN/m\"", "normal_stiffness = \"30 GPa\"",
     "interface.rock/slope.normal_stiffness", "must be \"hard\", N/m or Pa/m: this one is in Pa"},
    {"normal_stiffness = \"30 GN/m\"", "normal_stiffness = \"soft\"", "interface.rock/slope.normal_stiffness",
     "does not start with a number"},
    {"normal_stiffness = \"30 GN/m\"", "normal_stiffness = \"hard\"", "interface.rock/slope.shear_stiffness",
     "hard contact has no shear spring"},
    {"normal_stiffness = \"30 GN/m\"\nshear_stiffness = \"3.5 GN/m\"",
     "normal_stiffness = \"hard\"\ndamping_ratio = 0.5", "interface.rock/slope.damping_ratio",
     "hard contact has no spring to damp"},
    {"normal_stiffness = \"30 GN/m\"", "normal_stiffness = 0", "interface.rock/slope.normal_stiffness",
     "must be > 0"},
    {"normal_stiffness = \"30 GN/m\"\n", "", "interface.rock/slope.shear_stiffness",
     "needs a normal_stiffness"},
    {"shear_stiffness = \"3.5 GN/m\"", "shear_stiffness = \"3.5 GPa/m\"",
     "interface.rock/slope.shear_stiffness", "must be in the unit of normal_stiffness"},
    {"restitution = 0.4", "restitution = 1.4", "interface.rock/slope.restitution",
     "must be at least 0 and at most 1"},
    {"restitution = 0.4", "restitution = 0.4\nrestitution_half_speed = 0",
     "interface.rock/slope.restitution_half_speed", "must be > 0 m/s"},
    {"restitution = 0.4", "restitution = 0.4\nrestitution_half_speed = \"9 m\"",
     "interface.rock/slope.restitution_half_speed", "this one is in m"},
    {"restitution = 0.4", "restitution_half_speed = \"33 km/h\"",
     "interface.rock/slope.restitution_half_speed", "no restitution that could fall with speed"},
    {"friction = 0.5",
     "friction = 0.5\nrestitution = 0.1\n[[interface]]\nbetween = [\"*\", \"C40\"]\nfriction = "
     "0.5\nrestitution = 0.1\nrestitution_half_speed = 9",
     "interface.rock/*.between", "cover \"rock\" and \"C40\" and differ"},
    {"restitution = 0.4", "contact_law = \"hertz\"", "interface.rock/slope.contact_law",
     "\"hertz\" needs its parameter; write { kind = \"hertz\""},
    {"restitution = 0.4", "contact_law = \"linaer\"", "interface.rock/slope.contact_law",
     "did you mean \"linear\"?"},
    {"restitution = 0.4", "contact_law = { kind = \"hertz\" }", "interface.rock/slope.contact_law.radius",
     "a Hertz contact needs it"},
    {"restitution = 0.4", "contact_law = { kind = \"hertz\", radius = 1, pressure = 3 }",
     "interface.rock/slope.contact_law.pressure", "has no effect with kind = \"hertz\""},
    {"restitution = 0.4", "contact_law = { kind = \"table\", points = [[0, 0], [0, 5]] }",
     "interface.rock/slope.contact_law.points", "indentation and force must grow"},
    {"restitution = 0.4", "contact_law = { kind = \"table\", file = \"rock.obj\" }",
     "interface.rock/slope.contact_law.file", "no rows of numbers"},
    // blocks
    {"shape = \"box\"", "shape = \"cube\"", "block.B1.shape", "must be one of box, tetrahedron"},
    {"shape = \"box\"", "file = \"gone.obj\"", "block.B1.file", "there is no file"},
    {"shape = \"box\"", "shape = \"box\"\nfile = \"rock.obj\"", "block.B1.file",
     "the block is a box already"},
    {"shape = \"box\"", "shape = \"convex\"", "block.B1.vertices", "is missing"},
    {"shape = \"box\"", "shape = \"convex\"\nvertices = [[0,0,0],[1,0,0],[0,1,0]]", "block.B1.vertices",
     "at least 4 vertices"},
    {"size = [4.0, 5.0, \"575 cm\"]\n", "", "block.B1.size", "is missing"},
    {"size = [4.0, 5.0, \"575 cm\"]", "size = [4.0, -5.0, 1.0]", "block.B1.size", "must be > 0 m"},
    {"size = [4.0, 5.0, \"575 cm\"]", "mass = -5", "block.B1.mass", "must be > 0 kg"},
    {"size = [4.0, 5.0, \"575 cm\"]", "mass = 5\nvolume = 3", "block.B1.mass",
     "volume and mass both scale the shape"},
    {"position = [0.0, 0.0, 120.0]\n", "", "block.B1.position", "is missing"},
    {"position = [0.0, 0.0, 120.0]", "position = [0.0, 0.0, 1e400]", "", "not TOML"},
    {"{ dip_direction = \"2 deg\", dip = \"29 deg\" }", "{ dip = \"29 deg\" }",
     "block.B1.orientation.dip_direction", "is missing"},
    {"{ dip_direction = \"2 deg\", dip = \"29 deg\" }", "{ quaternion = [0, 0, 0, 0] }",
     "block.B1.orientation.quaternion", "must not be zero"},
    {"{ dip_direction = \"2 deg\", dip = \"29 deg\" }", "{ quaternion = [1, 0, 0] }",
     "block.B1.orientation.quaternion", "must be four numbers"},
    {"{ dip_direction = \"2 deg\", dip = \"29 deg\" }", "{ quaternion = [1, 0, 0, 0], dip = 0 }",
     "block.B1.orientation", "must have exactly one form"},
    {"velocity = [0.0, 0.0, -1.0]", "fixed = true\nvelocity = [0.0, 0.0, -1.0]", "block.B1.fixed",
     "a fixed block has no velocity"},
    {"velocity = [0.0, 0.0, -1.0]", "veloctiy = [0.0, 0.0, -1.0]", "block.B1.veloctiy",
     "did you mean \"velocity\"?"},
    {"material = \"rock\"\nshape = \"box\"", "material = \"C40\"\ndeformable = true\nshape = \"box\"",
     "block.B1.deformable", "needs a material with young"},
    {"name = \"B1\"", "name = \"..\"", "block....name", "a name has 1 to 100 bytes"},
    {"position = [0.0, 0.0, 120.0]", "position = [0.0, 0.0, 120.0]\nrelease = { polygon = \"area.geojson\" }",
     "block.B1.position", "a block with a release area has none of its own"},
    {"position = [0.0, 0.0, 120.0]\norientation = { dip_direction = \"2 deg\", dip = \"29 deg\" }",
     "release = { polygon = \"area.geojson\", count = 0 }", "block.B1.release.count", "must be at least 1"},
    // rock mass
    {"region = \"mass.obj\"", "region = \"mass.obj\"\nblocks = \"mass.obj\"", "rock_mass.region",
     "the blocks are cut already"},
    {"region = \"mass.obj\"", "region = \"mass.obj\"\nbox = { min = [0,0,0], max = [1,1,1] }",
     "rock_mass.box", "the region is given twice"},
    {"region = \"mass.obj\"\n", "", "rock_mass.region", "is missing: or box"},
    {"orientation = \"267/87\"", "orientation = \"267/97\"", "rock_mass.joint_set.J3.orientation",
     "the dip must be 0 to 90 degrees"},
    {"orientation = \"267/87\"", "orientation = \"267-87\"", "rock_mass.joint_set.J3.orientation",
     "must be \"dip direction/dip\""},
    {"spacing = \"3.84 m\"", "spacing = 0", "rock_mass.joint_set.J3.spacing", "must be > 0 m"},
    {"spacing = \"3.84 m\"", "spacing = 3\npersistence = 0", "rock_mass.joint_set.J3.persistence",
     "must be above 0 and at most 1"},
    {"spacing = \"3.84 m\"", "spacing = 3\nspacing_distribution = \"normal\"",
     "rock_mass.joint_set.J3.spacing_deviation", "the normal distribution needs it"},
    {"through = [1.0, 2.0, 3.0]", "through = [1.0, 2.0, 3.0]\npolygon = [[1,2,3],[2,2,3],[2,3,9]]",
     "rock_mass.joint.0.polygon", "every corner must lie in the plane"},
    // structures
    {"kind = \"column\"", "kind = \"pier\"", "structure.P2.kind",
     "must be one of viaduct, column, box, mesh"},
    {"cell_size = \"0.25 m\"", "cell_size = \"0.25 m\"\ncells = [8, 8, 48]", "structure.P2.cells",
     "cell_size and cells say the same thing"},
    {"cell_size = \"0.25 m\"\n", "", "structure.P2.cell_size", "is missing"},
    {"cell_size = \"0.25 m\"", "cells = [8, 8, 0]", "structure.P2.cells", "must be at least 1"},
    {"kind = \"column\"", "kind = \"box\"", "structure.P2.section",
     "has no effect with kind = \"box\"; remove it, or write kind = \"column\" or \"viaduct\""},
    {"kind = \"column\"", "kind = \"box\"\nsection_size = [2, 2]", "structure.P2.section_size",
     "has no effect with kind = \"box\""},
    {"kind = \"column\"", "kind = \"mesh\"\ndiameter = 2", "structure.P2.diameter",
     "has no effect with kind = \"mesh\""},
    {"kind = \"column\"", "kind = \"mesh\"\nwall_thickness = 0.2", "structure.P2.wall_thickness",
     "has no effect with kind = \"mesh\""},
    {"kind = \"column\"", "kind = \"mesh\"", "structure.P2.cell_size", "a mesh file brings its own cells"},
    {"kind = \"column\"", "kind = \"column\"\nparameters = { cap_height = 2 }", "structure.P2.parameters",
     "only a viaduct has further measures"},
    {"damage = \"concrete\"",
     "damage = \"concrete\"\nrefine = [{ region = { min = [19, -1, 0], max = [21, 1, 2] }, cell_size = \"1 "
     "m\" }]",
     "structure.P2.refine.0.cell_size", "must not exceed"},
    {"cell_size = \"0.25 m\"",
     "cells = [8, 8, 48]\nrefine = [{ region = { min = [19, -1, 0], max = [21, 1, 2] }, cell_size = \"0.1 "
     "m\" }]",
     "structure.P2.refine", "cells fixes their number"},
    {"damage = \"concrete\"", "damage = \"concrete\"\nrefine = [{ cell_size = \"0.1 m\" }]",
     "structure.P2.refine.0.region", "a zone of finer cells needs its place"},
    {"damage = \"concrete\"",
     "damage = \"concrete\"\nrefine = [{ where = \"impact\", cell_size = \"0.1 m\", local = true }]",
     "structure.P2.refine.0.local", "has no meaning with where"},
    {"height = \"12 m\"\n", "", "structure.P2.height", "a column needs it"},
    {"height = \"12 m\"", "height = \"12 m\"\nspans = 3", "structure.P2.spans",
     "only a viaduct has this measure"},
    {"section = [2.0, 2.0]", "section = \"hollow\"\nsection_size = [2, 2]\nwall_thickness = 1",
     "structure.P2.wall_thickness", "twice the wall must be less"},
    {"section = [2.0, 2.0]", "section = \"hollow\"\ndiameter = 2\nwall_thickness = 0.3",
     "structure.P2.diameter", "a hollow one has section_size"},
    {"support = [\"-z\"]", "support = [\"z\"]", "structure.P2.support", "\"z\" is no face"},
    {"support = [\"-z\"]", "support = \"-z\"", "structure.P2.support", "must be a list; write [\"-z\"]"},
    {"support = [\"-z\"]", "support = [{ face = \"-z\", held = \"xw\" }]", "structure.P2.support.0.held",
     "some of the letters x, y, z"},
    {"support = [\"-z\"]", "support = []", "structure.P2.preload", "no state at rest under gravity"},
    {"damage = \"concrete\"", "damage = \"concrete-cdpm\"", "structure.P2.damage",
     "did you mean \"concrete-cdpm2\"?"},
    {"material = \"C40\"", "material = \"C50\"", "structure.P2.material", "did you mean \"C40\"?"},
    {"rebar = \"bars.csv\"", "rebar = [{ kind = \"longitudinal\", diameter = \"20 mm\", cover = \"4 cm\" }]",
     "structure.P2.rebar.0.bars", "need a number of at least 1"},
    {"rebar = \"bars.csv\"",
     "rebar = [{ kind = \"stirrups\", spacing = 0.2, diameter = \"20 mm\", cover = 0 }]",
     "structure.P2.rebar.0.cover", "must be > 0 m"},
    {"section = [2.0, 2.0]", "section = \"round\"\nsection_size = [2, 2]\ndiameter = 1",
     "structure.P2.section_size", "has its diameter already"},
    {"history = [[0.0, 0.0], [\"5 ms\", 1.0]]", "history = [[0.0, 0.0], [0.0, 1.0]]",
     "structure.P2.load.0.history", "the times must grow"},
    {"traction = [\"2 MPa\", 0.0, 0.0]\n", "", "structure.P2.load.0.traction", "is missing"},
    {"[[structure.probe]]\nname = \"top\"", "[[structure.probe]]", "structure.P2.probe.0.name", "is missing"},
    // coupling, output
    {"scheme = \"two-way\"", "scheme = \"twoway\"", "coupling.scheme", "did you mean \"two-way\"?"},
    {"audit = \"strict\"", "audit = \"none\"", "coupling.audit", "must be one of strict, report"},
    {"interval = \"0.05 s\"", "interval = \"0.05 Hz\"", "output.interval", "this one is in 1/s"},
    {"velocity = [0.0, 0.0, -1.0]", "spin = [\"2 Hz\", 0, 0]", "block.B1.spin", "turns a second"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1\npoint = [0,0,0]\nvelocity = "
     "0\n[output]",
     "impact.velocity", "a speed must be > 0"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1\ntrajectories = \"paths.csv\"\nrow = "
     "3\n[output]",
     "impact.row", "the file has 2 rows"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1\ntrajectories = \"still.csv\"\nrow = "
     "1\n[output]",
     "impact.trajectories", "velocity in this row must not be zero"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1\ntrajectories = "
     "\"twice.csv\"\n[output]",
     "impact.trajectories", "has two columns vx"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1\ntrajectories = \"half.csv\"\n[output]",
     "impact.trajectories", "some of wx, wy, wz but not all"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"odd.csv\"\nrow = 1\n[output]",
     "impact.trajectories", "row 1 (line 3) of the file: vx = 1e+07: must not exceed 100000 m/s"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"odd.csv\"\nrow = 2\n[output]",
     "impact.trajectories", "row 2 (line 4) of the file: wy = 1e+200: must not exceed 1e+06"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"odd.csv\"\nrow = 3\n[output]",
     "impact.trajectories", "row 3 (line 5) of the file: mass = 1e+300: must not exceed 1e+15 kg"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"odd.csv\"\nrow = 4\n[output]",
     "impact.trajectories", "row 4 (line 6) of the file: mass = 1e-300: the mass in this row must be > 0"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"odd.csv\"\nrow = 5\n[output]",
     "impact.trajectories", "row 5 (line 7) of the file: y = -2e+09: must not exceed 1e+09 m"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"both.csv\"\nrow = 1\n[output]",
     "impact.trajectories", "mass = 2500, volume = 7: contradict each other"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\nmass = 5\ntrajectories = \"paths.csv\"\nrow = "
     "1\n[output]",
     "impact.mass", "has a column mass already"},
    {"[output]",
     "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\nvolume = 5\ntrajectories = \"paths.csv\"\nrow = "
     "1\n[output]",
     "impact.volume", "has a column mass already"},
    {"[output]", "[output", "", "not TOML"},
    {"[output]", "[site]", "", "not TOML"},
};

TEST(BrokenScenes, EachSaysWhatIsWrongWhereAndWhatToDo) {
  const Place place;
  EXPECT_GE(std::size(list), 100u);
  for (const Broken& broken : list) {
    SCOPED_TRACE(std::string(broken.from) + "  ->  " + broken.to);
    const std::string text = changed(full, broken.from, broken.to);
    try {
      read_scene_text(text, place.scene());
      ADD_FAILURE() << "was accepted";
    } catch (const InputError& error) {
      bool said = false;
      for (const Problem& p : error.problems()) {
        EXPECT_EQ(p.file, place.scene()) << p.str();
        EXPECT_GT(p.line, 0) << p.str();
        EXPECT_GT(p.column, 0) << p.str();
        EXPECT_FALSE(p.rule.empty()) << p.str();
        if (p.severity == Problem::Severity::error) { EXPECT_FALSE(p.remedy.empty()) << p.str(); }
        said = said ||
               (p.key == broken.key && (p.rule + "; " + p.remedy).find(broken.message) != std::string::npos);
      }
      EXPECT_TRUE(said) << "expected " << broken.key << ": " << broken.message << "\ngot\n" << error.what();
    }
  }
}

TEST(BrokenScenes, AllProblemsAtOnceInTheOrderOfTheFile) {
  const Place place;
  std::string text = changed(full, "duration = \"30 s\"", "duration = \"30 kg\"");
  text = changed(text, "density = \"2.5 t/m^3\"", "density = -1");
  text = changed(text, "shape = \"box\"", "shape = \"bxo\"");
  text = changed(text, "audit = \"strict\"", "audti = \"strict\"");
  text = changed(text, "height = \"12 m\"\n", "");
  try {
    read_scene_text(text, place.scene());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_GE(error.problems().size(), 5u);
    for (std::size_t i = 1; i < error.problems().size(); ++i)
      EXPECT_LE(error.problems()[i - 1].line, error.problems()[i].line);
    // The column is that of the value, the line that of the file.
    EXPECT_EQ(error.problems()[0].line, 5);
    EXPECT_EQ(error.problems()[0].column, 12);
  }
}

/// What follows from a wrong line alone is not told beside it.
TEST(BrokenScenes, OneMistakeIsToldOnce) {
  const Place place;
  const Broken mistakes[] = {
      {"material = \"C40\"", "material = \"C 40\"", "structure.P2.material", "there is no such material"},
      {"[[structure]]", "[[structures]]", "structures", "unknown key"},
      {"f_cm = \"48 MPa\"", "f_ck = \"40 MPa\"", "material.C40.f_ck", "unknown key"},
      {"density = \"2.5 t/m^3\"", "denstiy = \"2.5 t/m^3\"", "material.rock.denstiy", "unknown key"},
      {"size = [", "Size = [", "block.B1.Size", "unknown key"},
      {"density = \"2.5 t/m^3\"", "density = \"2.5 kg\"", "material.rock.density", "this one is in kg"},
      {"f_cm = \"48 MPa\"", "f_cm = \"48 MN\"", "material.C40.f_cm", "this one is in N"},
      {"f_cm = \"48 MPa\"",
       "young = \"30 GN\"\ndensity = 2450\n[[material]]\nname = \"C41\"\nf_cm = \"48 MPa\"",
       "material.C40.young", "this one is in N"},
      {"f_cm = \"48 MPa\"",
       "young = \"30 GPa\"\ndensity = 2450 # kg\n[[material]]\nname = \"C41\"\nf_cm = \"48 MPa\"",
       "structure.P2.damage", "needs a concrete"},
      {"between = [\"rock\", \"*\"]", "between = [\"slope\", \"rock\"]", "interface.slope/rock.between",
       "says something else"},
      {"between = [\"rock\", \"*\"]\nfriction = 0.5", "between = [\"*\", \"*\"]\nfriction = 0.5",
       "interface.*/*.between", "says something else"},
      {"support = [\"-z\"]", "support = [\"z\"]", "structure.P2.support", "is no face"},
      {"support = [\"-z\"]", "support = [{ face = \"-z\", point = [0, 0, 0] }]", "structure.P2.support.0",
       "exactly one of"},
  };
  for (const Broken& broken : mistakes) {
    SCOPED_TRACE(broken.to);
    std::string text = changed(full, broken.from, broken.to);
    if (std::string(broken.key) == "material.C40.young")
      text =
          changed(changed(text, "damage = \"concrete\"", "damage = \"none\""), "rebar = \"bars.csv\"\n", "");
    else if (std::string(broken.key) == "structure.P2.damage")
      text = changed(text, "rebar = \"bars.csv\"\n", "");
    try {
      read_scene_text(text, place.scene());
      ADD_FAILURE() << "was accepted";
    } catch (const InputError& error) {
      std::string keys;
      int errors = 0;
      for (const Problem& p : error.problems())
        if (p.severity == Problem::Severity::error) ++errors, keys += p.key + ": " + p.rule + "\n";
      EXPECT_EQ(errors, 1) << keys;
      EXPECT_NE(keys.find(broken.key), std::string::npos) << keys;
      EXPECT_NE(keys.find(broken.message), std::string::npos) << keys;
    }
  }
}

TEST(BrokenScenes, ADecimalCommaIsReadAsAPoint) {
  const Place place;
  std::string text = changed(full, "height = \"12 m\"", "height = 8,5   # m");
  text = changed(text, "density = \"2.5 t/m^3\"", "density = 2500,0");
  text = changed(text, "audit = \"strict\"", "audti = \"strict\"");
  try {
    read_scene_text(text, place.scene());
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.problems().size(), 3u) << error.what();
    EXPECT_EQ(error.problems()[0].key, "density");
    EXPECT_EQ(error.problems()[0].value, "2500,0");
    EXPECT_EQ(error.problems()[0].line, 19);
    EXPECT_EQ(error.problems()[0].column, 11);
    EXPECT_EQ(error.problems()[1].remedy, "write 8.5");
    EXPECT_EQ(error.problems()[2].key, "coupling.audti");
  }
}

TEST(BrokenScenes, AnEmptyListOfBlocksIsNone) {
  const Place place;
  const std::string ground =
      "[simulation]\nduration = 1\n[[material]]\nname = \"rock\"\ndensity = 2500\n[[plane]]\nnormal = [0, 0, "
      "1]\nmaterial = \"rock\"\n";
  for (const char* list : {"", "block = []\n", "structure = []\n", "block = []\nstructure = []\n"}) {
    try {
      read_scene_text(list + std::string("schema = 1\n") + ground, place.scene());
      ADD_FAILURE() << list << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("no block, no rock mass and no structure"), std::string::npos)
          << error.what();
    }
  }
}

TEST(BrokenScenes, PairsThatCanMeetNeedAnEntry) {
  const Place place;
  std::string text = full.substr(0, full.find("[[structure]]"));
  text = changed(
      text, "[[interface]]\nbetween = [\"*\", \"*\"]\nfriction = 0.6\nnormal_stiffness = \"20 GPa/m\"\n", "");
  text = changed(text, "[[interface]]\nbetween = [\"rock\", \"*\"]\nfriction = 0.5\n", "");
  const auto missing = [&](const std::string& scene) -> std::string {
    try {
      read_scene_text(scene, place.scene());
    } catch (const InputError& error) { return error.what(); }
    return {};
  };
  EXPECT_NE(missing(text).find("\"rock\" and \"rock\" can meet, and no [[interface]] covers them"),
            std::string::npos);
  // One block alone cannot meet its like; nor can two that are both fixed.
  const std::string alone = text.substr(0, text.find("[rock_mass]"));
  EXPECT_EQ(missing(alone), "");
  const std::string second =
      "[[block]]\nname = \"B2\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1,1,1]\nposition = [9,9,9]\n";
  EXPECT_NE(missing(alone + second).find("can meet"), std::string::npos);
  const std::string fixed =
      changed(alone, "velocity = [0.0, 0.0, -1.0]", "fixed = true") + second + "fixed = true\n";
  EXPECT_EQ(missing(fixed), "");
}

TEST(BrokenScenes, FilesThatAreNoScene) {
  const Place place;
  const auto said = [](const std::string& path) -> std::string {
    try {
      read_scene(path);
    } catch (const InputError& error) { return error.what(); }
    return "accepted";
  };
  EXPECT_NE(said((place.path() / "gone.toml").string()).find("there is no such file"), std::string::npos);
  EXPECT_NE(said((place.path() / "folder").string()).find("is a directory"), std::string::npos);
  EXPECT_NE(said("/dev/null").find("is not a file"), std::string::npos);
  place.put("bytes.toml", std::string("\x89PNG\r\n\x1a\n\0\xff\xfe", 12));
  EXPECT_NE(said((place.path() / "bytes.toml").string()).find("not TOML"), std::string::npos);
  place.put("empty.toml", "");
  EXPECT_NE(said((place.path() / "empty.toml").string()).find("schema: is missing"), std::string::npos);
  place.put("half.json", "{\"schema\": 1,\n \"title\": ");
  EXPECT_NE(said((place.path() / "half.json").string()).find("half.json:2:"), std::string::npos);
  place.put("list.json", "{\"schema\": 1, \"title\": null, \"block\": 5, \"material\": {\"a\": [[[[]]]]}}");
  EXPECT_NE(said((place.path() / "list.json").string()).find("must be a list of tables"), std::string::npos);
  std::string deep = "schema = 1\ntitle = ";
  deep += std::string(100000, '[') + std::string(100000, ']');
  place.put("deep.toml", deep);
  EXPECT_NE(said((place.path() / "deep.toml").string()), "accepted");
  place.put("deep.json", "{\"title\": " + std::string(100000, '[') + std::string(100000, ']') + "}");
  EXPECT_NE(said((place.path() / "deep.json").string()), "accepted");
}

// Every prefix of a good scene, and every scene with one byte changed, is read or refused, never anything
// else.
TEST(BrokenScenes, CutOffAndDamagedTextIsReadOrRefused) {
  const Place place;
  const auto tried = [&](const std::string& text) {
    try {
      read_scene_text(text, place.scene());
    } catch (const InputError& error) { EXPECT_FALSE(error.problems().empty()); }
  };
  for (std::size_t n = 0; n < full.size(); n += 7) tried(full.substr(0, n));
  unsigned state = 1;
  for (int i = 0; i < 600; ++i) {
    std::string text = full;
    for (int k = 0; k < 3; ++k) {
      state = state * 1664525u + 1013904223u;
      constexpr std::string_view odd = "\"[]{}=.,#0-9e\n\\\x01\xff ab";
      text[(state >> 8) % text.size()] = odd[(state >> 3) % odd.size()];
    }
    tried(text);
  }
}

}  // namespace
}  // namespace talus::scene
