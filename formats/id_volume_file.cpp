#include "formats/id_volume_file.h"
