// What compute shaders share: workgroups numbered across both dimensions of a dispatch.

uint WorkgroupIndex() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
