#include "formats/obj_mesh.h"
