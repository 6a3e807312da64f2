# Semantic segmentation with Pointcept: a linear head above PTv3. The classes are the primitive types of parts.
# In a checkout of Pointcept: python tools/train.py --config-file THIS_FILE --num-gpus 1 --options save_path=exp/semseg
_base_ = ["pointcept_data.py"]

# The run: what Pointcept's default_runtime.py holds, so that this folder needs no path into the checkout.
weight = None
resume = False
evaluate = True
test_only = False
seed = 0
save_path = "exp/partprobe-semseg"
num_worker = 4
batch_size = 4
gradient_accumulation_steps = 1
batch_size_val = None
batch_size_test = None
epoch = 100
eval_epoch = 100
clip_grad = 3.0
sync_bn = False
enable_amp = False
amp_dtype = "float16"
empty_cache = False
empty_cache_per_epoch = False
find_unused_parameters = False
enable_wandb = False
wandb_project = "partprobe"
wandb_key = None
mix_prob = 0

model = dict(
    type="DefaultSegmentorV2",
    num_classes=N_CLASSES,
    backbone_out_channels=64,
    backbone=dict(
        type="PT-v3m1",
        in_channels=6,
        order=("z", "z-trans", "hilbert", "hilbert-trans"),
        stride=(2, 2, 2, 2),
        enc_depths=(2, 2, 2, 6, 2),
        enc_channels=(32, 64, 128, 256, 512),
        enc_num_head=(2, 4, 8, 16, 32),
        enc_patch_size=(1024, 1024, 1024, 1024, 1024),
        dec_depths=(2, 2, 2, 2),
        dec_channels=(64, 64, 128, 256),
        dec_num_head=(4, 4, 8, 16),
        dec_patch_size=(1024, 1024, 1024, 1024),
        drop_path=0.3,
        shuffle_orders=True,
        enable_flash=False,  # True needs the package flash_attn and enable_amp
        upcast_attention=False,
        upcast_softmax=False,
    ),
    criteria=[
        dict(type="CrossEntropyLoss", loss_weight=1.0, ignore_index=-1),
        dict(type="LovaszLoss", mode="multiclass", loss_weight=1.0, ignore_index=-1),
    ],
)

_voxels = dict(type="GridSample", grid_size=0.02, hash_type="fnv", mode="train", return_grid_coord=True)
_features = ("coord", "normal")
_train_transform = [
    dict(type="NormalizeCoord"),
    dict(type="RandomRotate", angle=[-1, 1], axis="z", center=[0, 0, 0], p=0.5),
    dict(type="RandomRotate", angle=[-1, 1], axis="x", center=[0, 0, 0], p=0.5),
    dict(type="RandomRotate", angle=[-1, 1], axis="y", center=[0, 0, 0], p=0.5),
    dict(type="RandomScale", scale=[0.8, 1.2]),
    dict(type="RandomFlip", p=0.5),
    dict(type="RandomJitter", sigma=0.005, clip=0.02),
    _voxels,
    dict(type="ToTensor"),
    dict(type="Collect", keys=("coord", "grid_coord", "segment"), feat_keys=_features),
]
# All points are scored, those that share a voxel too.
_val_transform = [
    dict(type="NormalizeCoord"),
    dict(type="Copy", keys_dict={"segment": "origin_segment"}),
    dict(_voxels, return_inverse=True),
    dict(type="ToTensor"),
    dict(
        type="Collect",
        keys=("coord", "grid_coord", "segment", "origin_segment", "inverse"),
        feat_keys=_features,
    ),
]
_test_cfg = dict(
    voxelize=dict(_voxels, mode="test"),
    crop=None,
    post_transform=[
        dict(type="ToTensor"),
        dict(type="Collect", keys=("coord", "grid_coord", "index"), feat_keys=_features),
    ],
    aug_transform=[[dict(type="RandomScale", scale=[1, 1])]],
)
data = dict(
    train=dict(transform=_train_transform),
    val=dict(transform=_val_transform),
    test=dict(transform=[dict(type="NormalizeCoord")], test_mode=True, test_cfg=_test_cfg),
)
del _voxels, _features, _train_transform, _val_transform, _test_cfg

optimizer = dict(type="AdamW", lr=0.002, weight_decay=0.05)
param_dicts = [dict(keyword="block", lr=0.0002)]
scheduler = dict(
    type="OneCycleLR",
    max_lr=[0.002, 0.0002],
    pct_start=0.05,
    anneal_strategy="cos",
    div_factor=10.0,
    final_div_factor=1000.0,
)

hooks = [
    dict(type="CheckpointLoader"),
    dict(type="IterationTimer", warmup_iter=2),
    dict(type="InformationWriter"),
    dict(type="SemSegEvaluator"),
    dict(type="CheckpointSaver", save_freq=None),
    dict(type="PreciseEvaluator", test_last=False),
]
train = dict(type="DefaultTrainer")
test = dict(type="SemSegTester", verbose=True)
