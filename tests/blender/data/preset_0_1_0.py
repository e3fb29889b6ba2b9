import bpy
bpy.context.object.meshfree.bandwidth = 'LOCAL'
bpy.context.object.meshfree.neighbors = 24
bpy.context.object.meshfree.bandwidth_factor = 1.25
bpy.context.object.meshfree.normals = 'WPCA'
bpy.context.object.meshfree.areas = 'CONSTRAINED'
bpy.context.object.meshfree.regularization = 0.0020000000949949026
bpy.context.object.meshfree.rims = 'OFF'
bpy.context.object.meshfree.sheets = False
bpy.context.object.meshfree.projection = 'QUADRIC'
bpy.context.object.meshfree.curvature_correction = False
bpy.context.object.meshfree.symbol_correction = False
