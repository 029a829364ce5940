/* The functions of libdc1394 2.2 that the driver calls, with emulated cameras behind them.

   Structures and numbers are written after the public headers; no part of the library is needed. The fake_ functions
   make the cameras misbehave. */

#define _GNU_SOURCE
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

enum { SUCCESS = 0, NOT_SUPPORTED = -3, NO_BANDWIDTH = -8, IOCTL_FAILURE = -9, INVALID_ARGUMENT = -15 };
enum { FORMAT7_0 = 88, MONO8 = 352, RAW8 = 361, FRAME_RATE = 431, POLL = 673, FRAME_INFO = 0x12F8 };
enum { MAX_WIDTH = 1288, MAX_HEIGHT = 964, PACKET_UNIT = 4, MAX_PACKET = 8192, PADDING = 8 };

typedef struct {
    uint64_t guid;
    int unit;
    uint32_t unit_spec_ID, unit_sw_version, unit_sub_sw_version, command_registers_base, unit_directory,
        unit_dependent_directory;
    uint64_t advanced_features_csr, PIO_control_csr, SIO_control_csr, strobe_control_csr, format7_csr[8];
    int iidc_version;
    char *vendor, *model;
    uint32_t vendor_id, model_id;
    int bmode_capable, one_shot_capable, multi_shot_capable, can_switch_on_off, has_vmode_error_status,
        has_feature_error_status, max_mem_channel;
    uint32_t flags;
} camera_t;

typedef struct {
    unsigned char *image;
    uint32_t size[2], position[2];
    int color_coding, color_filter;
    uint32_t yuv_byte_order, data_depth, stride;
    int video_mode;
    uint64_t total_bytes;
    uint32_t image_bytes, padding_bytes, packet_size, packets_per_frame;
    uint64_t timestamp;
    uint32_t frames_behind;
    camera_t *camera;
    uint32_t id;
    uint64_t allocated_image_bytes;
    int little_endian, data_in_padding;
} frame_t;

typedef struct { uint16_t unit; uint64_t guid; } id_t_;
typedef struct { uint32_t num; id_t_ *ids; } list_t;

typedef struct {
    camera_t camera; /* first, so that a pointer to it is one to this */
    frame_t frame;
    int timer, lent, coding, speed, transmitting, dma_buffers;
    uint32_t width, height, packet_size, frame_info, counter, pending;
    float fps;
} unit_t;

static struct {
    int cameras, drop, corrupt, stalled, unplugged, color_filter, open;
    uint32_t embeds;
    int64_t stamp_offset_ms;
} fake;

void fake_reset(void) {
    memset(&fake, 0, sizeof fake);
    fake.cameras = 1, fake.color_filter = 512, fake.embeds = 0x3FF;
}
void fake_cameras(int n) { fake.cameras = n; }
void fake_drop(int n) { fake.drop = n; }
void fake_corrupt(int n) { fake.corrupt = n; }
void fake_stall(int on) { fake.stalled = on; }
void fake_unplug(int on) { fake.unplugged = on; }
void fake_color_filter(int filter) { fake.color_filter = filter; }
void fake_embeds(uint32_t bits) { fake.embeds = bits; }
void fake_stamp_offset_ms(int64_t ms) { fake.stamp_offset_ms = ms; }
int fake_open(void) { return fake.open; }

static uint64_t now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return t.tv_sec * 1000000000ull + t.tv_nsec;
}

static uint32_t cycle_time(uint64_t ns) { /* 7 bits of seconds, 13 of cycles of 125 us, 12 of 3072 offsets */
    uint64_t in_second = ns % 1000000000ull;
    uint64_t offset = in_second % 125000ull * 3072 / 125000;
    return (uint32_t)(ns / 1000000000ull % 128 << 25 | in_second / 125000ull << 12 | offset);
}

static void put(unsigned char *at, uint32_t value) {
    for (int k = 0; k < 4; k++) at[k] = value >> (24 - 8 * k);
}

const char *dc1394_error_get_string(int error) {
    return error == IOCTL_FAILURE ? "IOCTL failure" : error == INVALID_ARGUMENT ? "Invalid argument value" : "Failure";
}
void *dc1394_new(void) { return fake.cameras < 0 ? NULL : malloc(1); }
void dc1394_free(void *context) { free(context); }

int dc1394_camera_enumerate(void *context, list_t **list) {
    (void)context;
    *list = calloc(1, sizeof **list);
    (*list)->num = fake.cameras;
    (*list)->ids = calloc(fake.cameras + 1, sizeof(id_t_));
    for (int k = 0; k < fake.cameras; k++) (*list)->ids[k].guid = 0x00b09d0100a1b2c0ull + k;
    return SUCCESS;
}
void dc1394_camera_free_list(list_t *list) { free(list->ids), free(list); }

camera_t *dc1394_camera_new(void *context, uint64_t guid) {
    (void)context;
    unit_t *unit = calloc(1, sizeof *unit);
    unit->camera.guid = guid;
    unit->camera.vendor = "Point Grey Research";
    unit->camera.model = "Flea2G FL2G-13S2C";
    unit->camera.bmode_capable = 1;
    unit->timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
    unit->fps = 15;
    unit->width = MAX_WIDTH, unit->height = MAX_HEIGHT;
    fake.open++;
    return &unit->camera;
}
void dc1394_camera_free(camera_t *camera) {
    unit_t *unit = (unit_t *)camera;
    close(unit->timer);
    free(unit->frame.image), free(unit);
    fake.open--;
}

int dc1394_read_cycle_timer(camera_t *camera, uint32_t *timer, uint64_t *local_us) {
    (void)camera;
    uint64_t now = now_ns();
    *timer = cycle_time(now), *local_us = now / 1000;
    return SUCCESS;
}
int dc1394_video_set_operation_mode(camera_t *camera, int mode) { (void)camera; return mode == 481 ? SUCCESS : INVALID_ARGUMENT; }
int dc1394_video_set_iso_speed(camera_t *camera, int speed) {
    ((unit_t *)camera)->speed = speed;
    return speed >= 0 && speed <= 3 ? SUCCESS : INVALID_ARGUMENT;
}
int dc1394_video_set_mode(camera_t *camera, int mode) { (void)camera; return mode == FORMAT7_0 ? SUCCESS : INVALID_ARGUMENT; }

int dc1394_format7_get_max_image_size(camera_t *camera, int mode, uint32_t *width, uint32_t *height) {
    (void)camera, (void)mode;
    *width = MAX_WIDTH, *height = MAX_HEIGHT;
    return SUCCESS;
}
int dc1394_format7_get_packet_parameters(camera_t *camera, int mode, uint32_t *unit, uint32_t *max) {
    (void)camera, (void)mode;
    *unit = PACKET_UNIT, *max = MAX_PACKET;
    return SUCCESS;
}
int dc1394_format7_get_color_filter(camera_t *camera, int mode, int *filter) {
    (void)camera, (void)mode;
    *filter = fake.color_filter;
    return SUCCESS;
}
int dc1394_format7_set_roi(camera_t *camera, int mode, int coding, int32_t packet, int32_t left, int32_t top,
                           int32_t width, int32_t height) {
    unit_t *unit = (unit_t *)camera;
    int valid = mode == FORMAT7_0 && (coding == MONO8 || coding == RAW8) && width > 0 && height > 0 &&
                left + width <= MAX_WIDTH && top + height <= MAX_HEIGHT;
    if (!valid || (packet != -3 && (packet % PACKET_UNIT || packet > MAX_PACKET))) return INVALID_ARGUMENT;
    unit->coding = coding, unit->width = width, unit->height = height, unit->packet_size = packet;
    return SUCCESS;
}

int dc1394_feature_set_power(camera_t *camera, int feature, int on) { (void)camera, (void)feature; return on == 1 ? SUCCESS : INVALID_ARGUMENT; }
int dc1394_feature_set_mode(camera_t *camera, int feature, int mode) { (void)camera, (void)feature; return mode == 736 ? SUCCESS : INVALID_ARGUMENT; }
int dc1394_feature_set_absolute_control(camera_t *camera, int feature, int on) { (void)camera, (void)feature; return on == 1 ? SUCCESS : INVALID_ARGUMENT; }
int dc1394_feature_set_absolute_value(camera_t *camera, int feature, float value) {
    if (feature == FRAME_RATE) ((unit_t *)camera)->fps = value > 120 ? 120 : value;
    return SUCCESS;
}
int dc1394_feature_get_absolute_value(camera_t *camera, int feature, float *value) {
    *value = ((unit_t *)camera)->fps;
    return feature == FRAME_RATE ? SUCCESS : NOT_SUPPORTED;
}

int dc1394_set_control_registers(camera_t *camera, uint64_t offset, const uint32_t *value, uint32_t count) {
    if (offset != FRAME_INFO || count != 1) return INVALID_ARGUMENT;
    ((unit_t *)camera)->frame_info = 0x80000000u | (*value & fake.embeds);
    return SUCCESS;
}
int dc1394_get_control_registers(camera_t *camera, uint64_t offset, uint32_t *value, uint32_t count) {
    if (offset != FRAME_INFO || count != 1) return INVALID_ARGUMENT;
    *value = ((unit_t *)camera)->frame_info;
    return SUCCESS;
}

int dc1394_capture_setup(camera_t *camera, uint32_t buffers, uint32_t flags) {
    unit_t *unit = (unit_t *)camera;
    if (flags != 4) return INVALID_ARGUMENT;
    unit->dma_buffers = buffers;
    unit->frame.stride = unit->width + PADDING;
    unit->frame.image = malloc((size_t)unit->frame.stride * unit->height);
    return SUCCESS;
}
int dc1394_capture_stop(camera_t *camera) { (void)camera; return SUCCESS; }
int dc1394_capture_get_fileno(camera_t *camera) { return ((unit_t *)camera)->timer; }

int dc1394_video_set_transmission(camera_t *camera, int on) {
    unit_t *unit = (unit_t *)camera;
    struct itimerspec period = {0};
    if (on) {
        period.it_interval.tv_nsec = period.it_value.tv_nsec = (long)(1e9 / unit->fps);
    }
    unit->transmitting = on;
    return timerfd_settime(unit->timer, 0, &period, NULL) ? IOCTL_FAILURE : SUCCESS;
}

static void expose(unit_t *unit, uint64_t at_ns) {
    frame_t *frame = &unit->frame;
    for (uint32_t y = 0; y < unit->height; y++)
        for (uint32_t x = 0; x < frame->stride; x++)
            frame->image[y * frame->stride + x] = x < unit->width ? (x + 3 * y + unit->counter) & 0xFF : 0xEE;
    unsigned char *at = frame->image;
    for (int bit = 0; bit < 10; bit++) {
        if (!(unit->frame_info >> bit & 1)) continue;
        put(at, bit == 0 ? cycle_time(at_ns + fake.stamp_offset_ms * 1000000) : bit == 6 ? unit->counter : 0);
        at += 4;
    }
    frame->size[0] = unit->width, frame->size[1] = unit->height;
    frame->color_coding = unit->coding, frame->color_filter = fake.color_filter;
    frame->video_mode = FORMAT7_0, frame->data_depth = 8;
    frame->image_bytes = unit->width * unit->height;
    frame->timestamp = now_ns() / 1000;
    frame->camera = &unit->camera;
}

int dc1394_capture_dequeue(camera_t *camera, int policy, frame_t **frame) {
    unit_t *unit = (unit_t *)camera;
    uint64_t expirations = 0;
    *frame = NULL;
    if (fake.unplugged) return IOCTL_FAILURE;
    if (policy != POLL || unit->lent) return INVALID_ARGUMENT;
    if (read(unit->timer, &expirations, sizeof expirations) < 0) expirations = 0;
    unit->pending += expirations;
    while (unit->pending) {
        uint64_t exposed_ns = now_ns() - (uint64_t)(1e9 / unit->fps * (unit->pending - 1)) - 2000000;
        int lost = fake.stalled || unit->pending > (uint32_t)unit->dma_buffers || fake.drop > 0;
        if (fake.drop > 0 && !fake.stalled) fake.drop--;
        unit->pending--, unit->counter++;
        if (lost) continue;
        expose(unit, exposed_ns);
        unit->frame.frames_behind = unit->pending;
        unit->lent = 1, *frame = &unit->frame;
        return SUCCESS;
    }
    return SUCCESS;
}
int dc1394_capture_enqueue(camera_t *camera, frame_t *frame) {
    unit_t *unit = (unit_t *)camera;
    if (frame != &unit->frame || !unit->lent) return INVALID_ARGUMENT;
    unit->lent = 0;
    return SUCCESS;
}
int dc1394_capture_is_frame_corrupt(camera_t *camera, frame_t *frame) {
    (void)camera, (void)frame;
    return fake.corrupt > 0 ? fake.corrupt-- > 0 : 0;
}
