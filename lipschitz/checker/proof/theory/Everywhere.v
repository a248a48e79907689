(** Parts of boxes that hold a multiple of every (x, 1) bound the slope everywhere. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges Relaxation Increments Signs Cover.
Import ListNotations.
Open Scope R_scope.

(** Layers without biases are positively homogeneous. *)
Definition no_bias (l : layerD) : Prop := Forall (fun a => real a = 0) (snd l).
Lemma affine_multiple w c a h : Forall (fun a => real a = 0) c ->
  affine (realm w) (reals c) (scaleR a h) = scaleR a (affine (realm w) (reals c) h).
Proof.
  intros H. unfold affine, apply. rewrite !map_map. revert c H.
  induction w as [|r w IH]; intros [|b c] H; simpl; auto; try inversion H as [|? ? Hb Hc]; subst.
  - f_equal; [rewrite Hb; ring|]. clear - Hc. induction Hc as [|d c Hd Hc IH]; simpl; auto. rewrite Hd.
    f_equal; [ring|auto].
  - rewrite dot_scale_r. f_equal. specialize (IH [] (Forall_nil _)). simpl in IH. now rewrite !plus_nil_r in IH.
  - rewrite dot_scale_r, Hb. f_equal; [ring|]. now apply IH.
Qed.
Lemma relu_multiple a y : 0 <= a -> map relu (scaleR a y) = scaleR a (map relu y).
Proof.
  intros H. unfold scale. rewrite !map_map. apply map_ext. intros b. destruct (Rle_dec 0 b).
  - rewrite !relu_right; auto. now apply Rmult_le_pos.
  - rewrite !relu_left; [ring|lra|nra].
Qed.
Lemma values_multiple ls k a h : Forall no_bias ls -> 0 <= a ->
  layer_values ls k (scaleR a h) = scaleR a (layer_values ls k h).
Proof.
  intros F H. revert k h. induction F as [|[w c] ls Hc F IH]; intros [|k] h; simpl; auto.
  - now apply affine_multiple.
  - rewrite affine_multiple, relu_multiple by auto. apply IH.
Qed.
Lemma signs_multiple ls lines a h : Forall no_bias ls -> 0 < a -> signs_hold ls lines (scaleR a h) ->
  signs_hold ls lines h.
Proof.
  intros F H. revert lines h. induction F as [|[w c] ls Hc F IH]; intros [|l lines] h; simpl; try tauto.
  rewrite affine_multiple, relu_multiple by (auto; lra). intros [S G]. split; auto. clear - S H. revert S.
  generalize (affine (realm w) (reals c) h). intros y S. remember (scaleR a y) as z. revert y Heqz.
  induction S as [|b v l z Hv S IH]; intros [|d y] E; simpl in E; try discriminate; constructor.
  - inversion E. subst. destruct b; simpl in *; auto; nra.
  - apply IH. now inversion E.
Qed.
Lemma excluded_multiple ls c a x : Forall no_bias ls -> 0 < a -> excluded ls c (scaleR a x) -> excluded ls c x.
Proof.
  intros F H. unfold excluded, value_at. rewrite !values_multiple, !nth_scaled by (auto; lra).
  intros (H1 & H2 & H3 & H4).
  repeat split; auto. apply (Rmult_le_reg_l a); auto. lra.
Qed.

(** The layers with a last input, at 1. *)
Lemma affine_app w e c d x : length c = length w -> affine (realm (w ++ e)) (reals (c ++ d)) x =
  affine (realm w) (reals c) x ++ affine (realm e) (reals d) x.
Proof.
  unfold affine, apply. revert c. induction w as [|r w IH]; intros [|a c] L; simpl in *; try discriminate; auto.
  f_equal. apply IH. lia.
Qed.
Lemma affine_widened w c x : length c = length w -> Forall (fun r => length r = length x) w ->
  affine (realm (widened w c)) (reals (map (fun _ => zero) (widened w c))) (x ++ [1]) = affine (realm w) (reals c) x.
Proof.
  intros L F. unfold affine, apply. revert c L.
  induction F as [|r w Hr F IH]; intros [|a c] L; simpl in *; try discriminate; auto.
  f_equal; [|apply IH; lia]. rewrite map_app, dot_app, real_zero by (now rewrite map_length). simpl. ring.
Qed.
Lemma is_chain_rows n w : forallb (fun r => length r =? n)%nat w = true ->
  Forall (fun r : list dyadic => length r = n) w.
Proof. rewrite forallb_forall, <- Forall_forall. apply Forall_impl. intros r. apply Nat.eqb_eq. Qed.
Lemma length_widened w c : length c = length w -> length (widened w c) = length w.
Proof. revert c. induction w as [|r w IH]; intros [|a c] L; simpl in *; try discriminate; auto. Qed.
Lemma homogeneous_run n ls last x : ls <> [] -> is_chain n ls = true -> length x = n ->
  Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  network (relu_layers (homogeneous n ls)) (real_layer last) (x ++ [1]) = network (relu_layers ls) (real_layer last) x.
Proof.
  intros N C L F. revert n x N C L. induction F as [|[w c] ls Hc F IH]; intros n x N C L; [congruence|].
  simpl in Hc, C. apply andb_prop in C. destruct C as [Cw C]. subst n. apply is_chain_rows in Cw.
  simpl homogeneous. rewrite map_app. simpl.
  pose proof (affine_app (widened w c) (match ls with [] => [] | _ => [unit_form (length x)] end)
    (map (fun _ => zero) (widened w c)) (map (fun _ => zero) (match ls with [] => [] | _ => [unit_form (length x)]
      end)) (x ++ [1])
    (map_length _ _)) as E.
  rewrite affine_widened in E by auto. unfold relu_layers in *.
  rewrite E. destruct ls as [|l ls].
  - simpl. now rewrite app_nil_r.
  - rewrite map_app. assert (affine (realm [unit_form (length x)]) (reals (map (fun _ => zero) [unit_form (length
      x)])) (x ++ [1]) = [1]) as U.
    { unfold affine. simpl. rewrite (dot_unit (length x) x 1 []), real_zero by auto. f_equal. ring. }
    rewrite U. assert (map relu [1] = [1]) as -> by (simpl; rewrite relu_right by lra; reflexivity).
    apply IH; try discriminate; auto. now rewrite map_length, length_affine, map_length; rewrite ?map_length.
Qed.
Lemma homogeneous_no_bias n ls : Forall no_bias (homogeneous n ls).
Proof.
  revert n. induction ls as [|[w c] ls IH]; intros n; simpl; constructor; auto. unfold no_bias. simpl.
  apply Forall_map, Forall_forall. intros. apply real_zero.
Qed.
Lemma homogeneous_fits n ls : Forall (fun l : layerD => length (snd l) = length (fst l)) (homogeneous n ls).
Proof. revert n. induction ls as [|[w c] ls IH]; intros n; simpl; constructor; auto. apply map_length. Qed.

(** A bound between points that lie on the same sides of planes holds between any two. *)
Section Planes.
Context (moves : list bool) (B : list R -> list R -> Prop) (D : list R -> Prop).
Context (joins : forall x y s, 0 <= s <= 1 -> agree moves x y -> B x (on_the_way s x y) -> B (on_the_way s x y) y ->
  B x y).
Context (convex : forall x y s, 0 <= s <= 1 -> D x -> D y -> D (on_the_way s x y)).
Definition level (g : list R -> R) : Prop := forall x y s, g (on_the_way s x y) = (1 - s) * g x + s * g y.
Lemma one_side_of_each gs : Forall level gs ->
  (forall x y, agree moves x y -> D x -> D y -> Forall (fun g => same_sign (g x) (g y)) gs -> B x y) ->
  forall x y, agree moves x y -> D x -> D y -> B x y.
Proof.
  intros F. induction F as [|g gs Hg F IH]; intros H; [intros x y A Dx Dy; now apply H|]. apply IH.
  intros x y A Dx Dy S. set (a := g x). set (b := g y).
  assert (same_sign a b -> B x y) as Same by (intros G; apply H; auto).
  destruct (Rle_dec 0 a) as [Ha|Ha], (Rle_dec 0 b) as [Hb|Hb]; try (apply Same; unfold same_sign; lra).
  all: set (s := a / (a - b)); assert (s * (a - b) = a) as Es by (unfold s; field; lra);
    assert (0 <= s <= 1) as Hs by (split; nra); destruct (way_agrees moves x y s A) as [A1 A2];
    assert (g (on_the_way s x y) = 0) as Z by (rewrite Hg; fold a b; lra);
    assert (Forall (fun g => same_sign (g x) (g (on_the_way s x y)) /\ same_sign (g (on_the_way s x y)) (g y)) gs) as S'
      by (rewrite Forall_forall in *; intros h Hh; rewrite (F h Hh); apply between_signs; auto; now apply S);
    apply (joins x y s Hs A); apply H; auto; constructor;
    try (rewrite Z; unfold same_sign; fold a b; lra); eapply Forall_impl; [|exact S'|  |exact S']; simpl; tauto.
Qed.
End Planes.

Lemma on_the_way_app s x y a b : length x = length y ->
  on_the_way s (x ++ [a]) (y ++ [b]) = on_the_way s x y ++ [(1 - s) * a + s * b].
Proof.
  unfold on_the_way. revert y. induction x as [|c x IH]; intros [|d y] L; simpl in *; try discriminate; auto.
  f_equal. apply IH. lia.
Qed.
Lemma within_nth b x : length x = length b ->
  (forall j, (j < length b)%nat -> real (fst (nth j b (zero, zero))) <= nth j x 0 <= real (snd (nth j b (zero,
    zero)))) -> within b x.
Proof.
  revert x. induction b as [|[l h] b IH]; intros [|a x] L H; simpl in *; try discriminate; auto.
  split; [apply (H O); lia|]. apply IH; [lia|]. intros j Hj. apply (H (S j)). lia.
Qed.
Lemma largest_of (q : nat -> R) n : exists k, (k <= n)%nat /\ forall j, (j <= n)%nat -> q j <= q k.
Proof.
  induction n as [|n (k & L & H)]; [exists O; split; auto; intros j Hj; replace j with O by lia; lra|].
  destruct (Rle_dec (q k) (q (S n))) as [G|G].
  - exists (S n). split; auto. intros j Hj. destruct (Nat.eq_dec j (S n)) as [->|]; [lra|].
    specialize (H j ltac:(lia)). lra.
  - exists k. split; [lia|]. intros j Hj. destruct (Nat.eq_dec j (S n)) as [->|]; [lra|]. apply H. lia.
Qed.

(** The faces of a box of n + 1 coordinates, the last one 1 at the points that matter. *)
Section Faces.
Context (radius : list dyadic) (positive : forallb is_positive radius = true).
Let n := length radius.
Definition reach_of (j : nat) : R := if (j =? n)%nat then 1 else real (nth j radius zero).
Lemma reach_positive j : (j <= n)%nat -> 0 < reach_of j.
Proof.
  intros L. unfold reach_of. destruct (Nat.eqb_spec j n); [lra|]. apply real_positive.
  rewrite forallb_forall in positive. apply positive, nth_In. fold n. lia.
Qed.
(** Points whose largest coordinate, over the radius, is k, with the sign s. *)
Definition faces_out (k : nat) (s : R) (z : list R) : Prop :=
  (exists x, z = x ++ [1] /\ length x = n) /\
  forall j, (j <= n)%nat -> nth j z 0 * reach_of k <= s * nth k z 0 * reach_of j /\
                            - (nth j z 0 * reach_of k) <= s * nth k z 0 * reach_of j.
Lemma faces_out_convex k s x y a : 0 <= a <= 1 -> faces_out k s x -> faces_out k s y ->
  faces_out k s (on_the_way a x y).
Proof.
  intros Ha [(v & -> & Lv) H] [(w & -> & Lw) G]. split.
  - exists (on_the_way a v w). rewrite on_the_way_app by congruence. rewrite length_way by congruence. split; auto.
    f_equal. f_equal. ring.
  - intros j Hj. rewrite !nth_on_the_way. specialize (H j Hj). specialize (G j Hj).
    set (p := nth j (v ++ [1]) 0) in *. set (q := nth j (w ++ [1]) 0) in *.
    set (p' := nth k (v ++ [1]) 0) in *. set (q' := nth k (w ++ [1]) 0) in *.
    assert (0 <= (1 - a) * (s * p' * reach_of j - p * reach_of k)) by (apply Rmult_le_pos; lra).
    assert (0 <= a * (s * q' * reach_of j - q * reach_of k)) by (apply Rmult_le_pos; lra).
    assert (0 <= (1 - a) * (s * p' * reach_of j + p * reach_of k)) by (apply Rmult_le_pos; lra).
    assert (0 <= a * (s * q' * reach_of j + q * reach_of k)) by (apply Rmult_le_pos; lra). split; lra.
Qed.
Lemma last_is_one x : length x = n -> nth n (x ++ [1]) 0 = 1.
Proof. intros <-. now rewrite nth_middle. Qed.
Definition size_by (k : nat) (s : R) (z : list R) : R := nth k z 0 * (s * / reach_of k).
Lemma size_by_way k s a x y : size_by k s (on_the_way a x y) = (1 - a) * size_by k s x + a * size_by k s y.
Proof. unfold size_by. rewrite nth_on_the_way. ring. Qed.
Lemma size_at_least_1 k s z : (k <= n)%nat -> faces_out k s z -> 1 <= size_by k s z.
Proof.
  intros Hk [(x & -> & L) H]. specialize (H n (le_n n)). rewrite last_is_one in H by auto.
  assert (reach_of n = 1) as E by (unfold reach_of; now rewrite Nat.eqb_refl). rewrite E in H.
  pose proof (reach_positive k Hk). unfold size_by. apply (Rmult_le_reg_r (reach_of k)); auto.
  replace (nth k (x ++ [1]) 0 * (s * / reach_of k) * reach_of k) with (s * nth k (x ++ [1]) 0) by (field; lra). lra.
Qed.
Lemma face_holds k s d z : (k <= n)%nat -> s = 1 \/ s = -1 -> real d = s * reach_of k -> faces_out k s z ->
  within (face radius k d) (looked_at (size_by k s) z).
Proof.
  intros Hk Hs Hd H. pose proof (size_at_least_1 k s z Hk H) as P. set (t := size_by k s z) in *.
  pose proof H as [(x & Hx & L) F]. pose proof (reach_positive k Hk) as Rk.
  assert (length z = S n) as Lz by (rewrite Hx, app_length; simpl; lia).
  assert (s * nth k z 0 = t * reach_of k) as T by (unfold t, size_by; field; lra).
  apply within_nth; unfold looked_at, face; fold n.
  - unfold scale. now rewrite !map_length, seq_length.
  - intros j Hj. rewrite map_length, seq_length in Hj. fold t.
    set (f j := if (j =? k)%nat then (d, d) else if (j =? n)%nat then (zero, one) else (neg (nth j radius zero),
      nth j radius zero)).
    rewrite (nth_indep (map f _) (zero, zero) (f O)) by (now rewrite map_length, seq_length).
    rewrite map_nth, seq_nth, Nat.add_0_l by lia. rewrite nth_scaled.
    assert (forall a b c, a * t <= b <= c * t -> a <= / t * b <= c) as Div.
    { intros a b c [G1 G2]. split; apply (Rmult_le_reg_l t); try lra; rewrite <- Rmult_assoc, Rinv_r by lra; lra. }
    unfold f. destruct (Nat.eqb_spec j k) as [->|Nk]; [|destruct (Nat.eqb_spec j n) as [->|Nn]]; simpl fst; simpl snd;
      apply Div.
    + rewrite Hd. destruct Hs; subst s; lra.
    + rewrite Hx, last_is_one, real_zero, real_one by auto. lra.
    + specialize (F j ltac:(lia)). assert (reach_of j = real (nth j radius zero)) as <-
        by (unfold reach_of; destruct (Nat.eqb_spec j n); [lia|auto]).
      rewrite T in F. rewrite real_neg. assert (reach_of j = real (nth j radius zero)) as <-
        by (unfold reach_of; destruct (Nat.eqb_spec j n); [lia|auto]).
      split; apply (Rmult_le_reg_r (reach_of k)); lra.
Qed.

Context (moves : list bool) (B : list R -> list R -> Prop).
Context (joins : forall x y s, 0 <= s <= 1 -> agree moves x y -> B x (on_the_way s x y) -> B (on_the_way s x y) y ->
  B x y).
Definition extended (z : list R) : Prop := exists x, z = x ++ [1] /\ length x = n.
Lemma on_some_face : (forall k s, (k <= n)%nat -> (s = 1 \/ s = -1 /\ (k < n)%nat) ->
    forall x y, agree moves x y -> faces_out k s x -> faces_out k s y -> B x y) ->
  forall x y, agree moves x y -> extended x -> extended y -> B x y.
Proof.
  intros H.
  apply (one_side_of_each moves B extended joins) with (gs := flat_map (fun k => flat_map (fun j =>
    [(fun z => nth k z 0 * reach_of j - nth j z 0 * reach_of k);
      (fun z => nth k z 0 * reach_of j + nth j z 0 * reach_of k)])
    (seq 0 (S n))) (seq 0 (S n))).
  - intros x y s _ (v & -> & Lv) (w & -> & Lw). exists (on_the_way s v w).
    rewrite on_the_way_app by congruence. rewrite length_way by congruence. split; auto. f_equal. f_equal. ring.
  - apply Forall_flat_map, Forall_forall. intros k _. apply Forall_flat_map, Forall_forall. intros j _.
    repeat constructor; intros x y s; rewrite !nth_on_the_way; ring.
  - intros x y A Ex Ey S. set (m j := (nth j x 0 + nth j y 0) / 2).
    destruct (largest_of (fun j => Rabs (m j) * / reach_of j) n) as (k & Hk & Largest).
    assert (forall j, (j <= n)%nat -> Rabs (m j) * reach_of k <= Rabs (m k) * reach_of j) as M.
    { intros j Hj. specialize (Largest j Hj). simpl in Largest. pose proof (reach_positive j Hj).
      pose proof (reach_positive k Hk).
      apply (Rmult_le_compat_r (reach_of j * reach_of k)) in Largest; [|apply Rlt_le, Rmult_lt_0_compat; lra].
      replace (Rabs (m j) * / reach_of j * (reach_of j * reach_of k)) with (Rabs (m j) * reach_of k) in Largest by
        (field; lra).
      replace (Rabs (m k) * / reach_of k * (reach_of j * reach_of k)) with (Rabs (m k) * reach_of j) in Largest by
        (field; lra).
      exact Largest. }
    assert (forall j, (j <= n)%nat ->
      same_sign (nth k x 0 * reach_of j - nth j x 0 * reach_of k) (nth k y 0 * reach_of j - nth j y 0 * reach_of k) /\
      same_sign (nth k x 0 * reach_of j + nth j x 0 * reach_of k) (nth k y 0 * reach_of j + nth j y 0 * reach_of k))
        as G.
    { intros j Hj. rewrite Forall_flat_map, Forall_forall in S. specialize (S k ltac:(apply in_seq; lia)).
      rewrite Forall_flat_map, Forall_forall in S. specialize (S j ltac:(apply in_seq; lia)).
      inversion S as [|? ? S1 S2]; subst. inversion S2; subst. tauto. }
    set (s := if Rle_dec 0 (m k) then 1 else -1).
    assert (Rabs (m k) = s * m k) as Sk.
    { unfold s. destruct (Rle_dec 0 (m k)); [rewrite Rabs_pos_eq|rewrite Rabs_left]; lra. }
    assert (forall z, extended z -> (forall j,
      (j <= n)%nat -> 0 <= s * nth k z 0 * reach_of j - nth j z 0 * reach_of k /\
      0 <= s * nth k z 0 * reach_of j + nth j z 0 * reach_of k) -> faces_out k s z) as Out.
    { intros z Ez F. split; auto. intros j Hj. specialize (F j Hj). lra. }
    apply (H k s Hk).
    + destruct (Rle_dec 0 (m k)) as [P|P]; [left; unfold s; destruct (Rle_dec 0 (m k)); lra|right]. split.
      * unfold s. destruct (Rle_dec 0 (m k)); lra.
      * destruct (Nat.eq_dec k n) as [->|]; [|lia]. exfalso. apply P. unfold m.
        destruct Ex as (v & -> & Lv), Ey as (w & -> & Lw). rewrite !last_is_one by auto. lra.
    + exact A.
    + apply Out; auto. intros j Hj. specialize (M j Hj). destruct (G j Hj) as [G1 G2]. rewrite Sk in M.
      pose proof (Rle_abs (m j)). pose proof (Rle_abs (- m j)) as N. rewrite Rabs_Ropp in N.
      pose proof (reach_positive k Hk).
      assert (m j * reach_of k <= s * m k * reach_of j) by nra.
      assert (- m j * reach_of k <= s * m k * reach_of j) by nra.
      unfold m in *. unfold s, same_sign in *. destruct (Rle_dec 0 _); split; lra.
    + apply Out; auto. intros j Hj. specialize (M j Hj). destruct (G j Hj) as [G1 G2]. rewrite Sk in M.
      pose proof (Rle_abs (m j)). pose proof (Rle_abs (- m j)) as N. rewrite Rabs_Ropp in N.
      pose proof (reach_positive k Hk).
      assert (m j * reach_of k <= s * m k * reach_of j) by nra.
      assert (- m j * reach_of k <= s * m k * reach_of j) by nra.
      unfold m in *. unfold s, same_sign in *. destruct (Rle_dec 0 _); split; lra.
Qed.
Lemma face_in_all k s : (k <= n)%nat -> (s = 1 \/ s = -1 /\ (k < n)%nat) ->
  exists d, In (face radius k d) (all_faces radius) /\ real d = s * reach_of k.
Proof.
  intros Hk Hs. unfold all_faces. fold n. destruct (Nat.eq_dec k n) as [->|N].
  - exists one. split; [now left|]. unfold reach_of. rewrite Nat.eqb_refl, real_one.
    destruct Hs as [->|[_ L]]; [ring|lia].
  - assert (reach_of k = real (nth k radius zero)) as -> by (unfold reach_of; destruct (Nat.eqb_spec k n); [lia|auto]).
    destruct Hs as [->|[-> _]]; [exists (nth k radius zero)|exists (neg (nth k radius zero))]; (split;
      [|rewrite ?real_neg; ring]);
      right; apply in_flat_map; exists k; (split; [apply in_seq; lia|simpl; auto]).
Qed.
End Faces.

Lemma trees_of_all o ls inequality bs ts b : check_trees o ls inequality bs ts = true -> In b bs ->
  exists t, check_tree o ls inequality b [] t = true.
Proof.
  revert ts. induction bs as [|c bs IH]; intros [|t ts]; simpl; try tauto; try discriminate. intros H. both H.
  intros [->|G]; [now exists t|]. eapply IH; eauto.
Qed.
Lemma agree_extended moves x y : agree moves x y -> agree (moves ++ [false]) (x ++ [1]) (y ++ [1]).
Proof.
  revert x y. induction moves as [|m moves IH]; intros [|a x] [|b y]; simpl; try tauto. intros [H G]. split; auto.
Qed.
Lemma square_in_extended scale x y : length x = length y ->
  square_in scale (minus (x ++ [1]) (y ++ [1])) = square_in scale (minus x y).
Proof.
  unfold minus. revert scale y. induction x as [|a x IH]; intros scale [|b y] L; simpl in *; try discriminate.
  - replace (1 + -1 * 1) with 0 by ring. unfold Rdiv. ring.
  - rewrite IH by lia. reflexivity.
Qed.
Lemma slope_everywhere_sound ps f moves scale u r form o radius ts :
  check_parts_of_all ps f moves scale u r form o radius ts = true -> holds ps (Slope_at_most f moves scale u).
Proof.
  unfold check_parts_of_all. intros H. cbv zeta in H. do 4 both H. set (p := part_at ps (moved f)) in *.
  rename H0 into HC, H1 into Hp, H2 into Hr, H3 into Hw. apply Nat.eqb_eq in Hr.
  assert (hidden p <> []) as Hn by (destruct (hidden p); [discriminate|discriminate]).
  intros rest x0 y0 A0 _. apply (parts_sound ps f moves scale u r form _ (fun _ => True) HC); auto.
  fold p. cbv beta. intros q T Fh Fo Hs Hm Hu Hru g G n LG MG x y A _ _.
  set (m := inputs_of p) in *. set (ls := homogeneous m (hidden p)) in *. set (moves' := moves ++ [false]).
  destruct (agree_lengths _ _ _ A) as [Lx Ly]. assert (length x = m /\ length y = m) as [Mx My] by (split; congruence).
  set (F z := G (removelast z)). assert (forall v, F (v ++ [1]) = G v) as Fv by (intros v; unfold F;
    now rewrite removelast_last).
  assert (forall z, length (F z) = n) as LF by (intros z; apply LG).
  assert (distance scale (x ++ [1]) (y ++ [1]) = distance scale x y) as Dist
    by (unfold distance; rewrite square_in_extended; congruence).
  rewrite <- Dist, <- !Fv. change (bounded_between scale (real u) F (x ++ [1]) (y ++ [1])).
  assert (forall a b s, 0 <= s <= 1 -> agree moves' a b -> bounded_between scale (real u) F a (on_the_way s a b) ->
    bounded_between scale (real u) F (on_the_way s a b) b -> bounded_between scale (real u) F a b) as Joins.
  { intros a b s Hs' A'. apply (between_halves scale (real u) F n LF); auto. destruct (agree_lengths _ _ _ A').
    congruence. }
  apply (on_some_face radius Hp moves' _ Joins); [|now apply agree_extended|exists x; split; congruence|exists y;
    split; congruence].
  intros k s Hk Hks. destruct (face_in_all radius k s Hk Hks) as (d & In_all & Hd).
  destruct (trees_of_all _ _ _ _ _ _ T In_all) as (t & Ht).
  assert (s = 1 \/ s = -1) as Hs1 by tauto.
  intros a b A' Da Db. apply (tree_covers o ls (part_inequality ls (outer p) q moves' scale r) moves' scale (real u) F n
    (faces_out radius k s) (size_by radius k s)) with (t := t) (b := face radius k d) (around := []) (D := faces_out
      radius k s); auto.
  - apply homogeneous_fits.
  - apply size_by_way.
  - intros z Hz. pose proof (size_at_least_1 radius Hp k s z Hk Hz). lra.
  - intros c z Hz. pose proof (size_at_least_1 radius Hp k s z Hk Hz). unfold looked_at.
    apply excluded_multiple; [apply homogeneous_no_bias|apply Rinv_0_lt_compat; lra].
  - intros lines cs ts' z w Hts N Hz Hw' Lz Lw Azw Same Ex.
    pose proof (size_at_least_1 radius Hp k s z Hk Hz) as Pz. pose proof (size_at_least_1 radius Hp k s w Hk Hw') as Pw.
    apply signs_of_lines, signs_multiple in Lz, Lw; try apply homogeneous_no_bias; try (apply Rinv_0_lt_compat; lra).
    destruct Hz as [(v & -> & Lv) _], Hw' as [(v' & -> & Lv') _].
    apply square_root_bound with (r := real r); auto using square_in_nonneg. rewrite !Fv.
    eapply Rle_trans; [apply MG|]. unfold g.
    rewrite <- (homogeneous_run m (hidden p) (outer p) v), <- (homogeneous_run m (hidden p) (outer p) v') by (auto;
      congruence).
    eapply part_holds; eauto using homogeneous_fits.
  - intros. now apply faces_out_convex.
  - intros z Hz. now apply face_holds.
  - intros. apply known_nothing.
Qed.
