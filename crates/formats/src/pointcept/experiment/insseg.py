# Instance segmentation with Pointcept: PointGroup above PTv3. The instances are the parts.
# In a checkout of Pointcept: python tools/train.py --config-file THIS_FILE --num-gpus 1 --options save_path=exp/insseg
_base_ = ["pointcept_data.py"]

# The run: what Pointcept's default_runtime.py holds, so that this folder needs no path into the checkout.
weight = None
resume = False
evaluate = True
test_only = False
seed = 0
save_path = "exp/partprobe-insseg"
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
    type="PG-v1m2",
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
    backbone_out_channels=64,
    semantic_num_classes=N_CLASSES,
    semantic_ignore_index=-1,
    segment_ignore_index=(-1,),
    instance_ignore_index=-1,
    # Parts are smaller than furniture: a shape has a few thousand voxels.
    cluster_thresh=1.5,
    cluster_closed_points=300,
    cluster_propose_points=20,
    cluster_min_points=10,
    voxel_size=0.02,  # grid_size of pointcept_data.py
    criteria=[
        dict(type="CrossEntropyLoss", loss_weight=1.0, ignore_index=-1),
        dict(type="LovaszLoss", mode="multiclass", loss_weight=1.0, ignore_index=-1),
    ],
)

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
    dict(type="InsSegEvaluator", segment_ignore_index=(-1,), instance_ignore_index=-1),
    dict(type="CheckpointSaver", save_freq=None),
    dict(type="PreciseEvaluator", test_last=False),
]
train = dict(type="DefaultTrainer")
test = dict(type="InsSegTester", segment_ignore_index=(-1,), instance_ignore_index=-1, verbose=False)
